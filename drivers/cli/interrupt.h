/* interrupt.h: makes SIGINT, SIGTERM and SIGHUP something that a program asks about between its steps. */
#ifndef FLESH_CLI_INTERRUPT_H
#define FLESH_CLI_INTERRUPT_H

/* Makes SIGINT, SIGTERM and SIGHUP remove half-written files before they end the program, from now on. */
void flesh_interrupt_tidy(void);
/* Makes the first SIGINT, SIGTERM or SIGHUP (unless ignored, as under nohup) from now on only be remembered, and end the
 * reading of a scene; the second one ends the program at once. */
void flesh_interrupt_watch(void);

/* A callback for flesh_scene_set_stop, also called between steps: returns FLESH_ERR_INTERRUPTED once a signal is
 * remembered, FLESH_ERR_BUDGET after *deadline (double, s on CLOCK_MONOTONIC; NULL: none), else FLESH_OK. */
int flesh_interrupt_asked(void *deadline);
/* Returns the remembered signal, or 0. */
int flesh_interrupt_signal(void);
/* Fails with FLESH_ERR_INTERRUPTED and a sentence once a signal is remembered. */
int flesh_interrupt_check(void);
/* Remembers a signal that another process received, unless one is remembered already. 0: does nothing. */
void flesh_interrupt_adopt(int signal_number);
/* Return the signal's name, and the exit code for it: 130 for SIGINT, 143 for SIGTERM, 129 for SIGHUP. */
const char *flesh_interrupt_name(void);
int flesh_interrupt_exit_code(void);

#endif
