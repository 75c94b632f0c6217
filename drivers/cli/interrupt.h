/* interrupt.h: SIGINT, SIGTERM and SIGHUP as something asked between steps. */
#ifndef FLESH_CLI_INTERRUPT_H
#define FLESH_CLI_INTERRUPT_H

/* From now on a SIGINT, SIGTERM or SIGHUP that ends the program leaves no half-written file. */
void flesh_interrupt_tidy(void);
/* From now on the first SIGINT, SIGTERM or SIGHUP (unless ignored, as under nohup) is only
 * remembered, and ends the reading of a scene; the second one ends the program at once. */
void flesh_interrupt_watch(void);

/* For flesh_scene_set_stop and in between: FLESH_ERR_INTERRUPTED once a signal is remembered; `deadline`: of
 * CLOCK_MONOTONIC, s, then FLESH_ERR_BUDGET; NULL: none. */
int flesh_interrupt_asked(void *deadline);
/* The remembered signal, or 0. */
int flesh_interrupt_signal(void);
/* FLESH_ERR_INTERRUPTED with a sentence once a signal is remembered. */
int flesh_interrupt_check(void);
/* Remembers a signal that came to another process, unless one is remembered already. 0: nothing. */
void flesh_interrupt_adopt(int signal_number);
/* Its name, and the exit code that says so: 130 for SIGINT, 143 for SIGTERM, 129 for SIGHUP. */
const char *flesh_interrupt_name(void);
int flesh_interrupt_exit_code(void);

#endif
