/* effect.h: what the built-in effects share in being made. */
#ifndef FLESH_EFFECT_EFFECT_H
#define FLESH_EFFECT_EFFECT_H

#include "flesh/effects.h"

/* Wraps `data` (taken: freed by operations->destroy, also when this fails) in a new effect. */
int flesh_effect_create(const flesh_effect_operations *operations, void *data,
                        flesh_effect **effect);

/* Makes cells of every tet of the mesh with its nodes ascending. Free with flesh_cells_clear. */
int flesh_cells_of_tets(const flesh_mesh *mesh, flesh_cells *cells);
void flesh_cells_clear(flesh_cells *cells);

/* FLESH_ERR_ARGUMENT where a tet's density is not positive and finite. */
int flesh_body_check_density(const flesh_body *body);

/* Parts of an interval [from, until) as the next event after t. */
double flesh_interval_next_event(double from, double until, double t);

#endif
