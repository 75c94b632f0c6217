/* interrupt.h: SIGINT and SIGTERM as something asked between steps. */
#ifndef FLESH_DRIVERS_INTERRUPT_H
#define FLESH_DRIVERS_INTERRUPT_H

/* From now on the first SIGINT or SIGTERM is only remembered; the second one ends the program at
 * once. */
void flesh_interrupt_watch(void);

/* The remembered signal, or 0. */
int flesh_interrupt_signal(void);

#endif
