/* energy_watch.h: notices energy that grows although nothing feeds it. */
#ifndef FLESH_INTEGRATOR_ENERGY_WATCH_H
#define FLESH_INTEGRATOR_ENERGY_WATCH_H

#include "flesh/integrator.h"

typedef struct flesh_energy_watch {
  const flesh_system *system;
  double *energies; /* [effects] */
  double *zeros;    /* [n] */
  uint8_t *fixed;   /* [n] */
  double *v_prescribed, *a_prescribed; /* [n] */
  int watching;     /* 0: the next state begins anew */
  double begin;     /* s, of what is watched */
  double least, kinetic, gain; /* J, J, share of kinetic */
} flesh_energy_watch;

int flesh_energy_watch_create(const flesh_system *system, flesh_energy_watch *watch);
void flesh_energy_watch_clear(flesh_energy_watch *watch);
/* Takes in a state; `restart` where energy may have come or gone before it by other means than motion. */
void flesh_energy_watch_see(flesh_energy_watch *watch, const flesh_state *state, int restart);

#endif
