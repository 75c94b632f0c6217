/* scene_keys.h: the structs into which a scene's keys are read, and the table of the top keys. */
#ifndef FLESH_SCENE_SCENE_KEYS_H
#define FLESH_SCENE_SCENE_KEYS_H

#include "base/key.h"
#include "flesh/scene.h"
#include "scene/fibres.h"
#include "scene/selection.h"

typedef struct flesh_scene_material {
  int energy, constants; /* flesh_energy, flesh_constants; -1: not given */
  flesh_material_given given;
} flesh_scene_material;

typedef struct flesh_scene_region {
  flesh_tet_selection tets;
  double density;
  flesh_scene_material material;
} flesh_scene_region;

/* A surface that boundary faces approximate; one of the three is given. */
typedef struct flesh_scene_curved {
  struct {
    double centre[3], radius;
  } sphere;
  struct {
    double from[3], to[3], radius;
  } cylinder;
  char *surface;
} flesh_scene_curved;

typedef struct flesh_scene_other {
  char *name, *mesh;
  flesh_objects curved; /* of flesh_scene_curved */
  double translation[3], rotation[3], density, velocity[3];
  int element; /* flesh_element; -1: the body's */
  flesh_scene_material material;
} flesh_scene_other;

/* A place at which a run writes quantities over time. */
typedef struct flesh_scene_probe {
  char *name;
  double point[3], about[3]; /* NaN: none */
  flesh_selection selection;
  char *effect; /* "pin[1]"; NULL: none */
  unsigned quantities; /* bits of flesh_probe_quantity */
} flesh_scene_probe;

typedef struct flesh_output_keys {
  flesh_scene_output given;
  flesh_objects probes; /* of flesh_scene_probe */
  int reactions;        /* 1: adds a probe of each pin, prescribed motion, contact, weld and joint */
  int error_bars;       /* 1: `flesh run` adds error bars */
} flesh_output_keys;

typedef struct flesh_scene_keys {
  char *title;
  struct {
    char *name, *mesh;
    double density;
    int mass; /* flesh_mass */
    int element; /* flesh_element */
    int refine;  /* number of refinements; each cuts every tet into eight */
    flesh_objects curved; /* of flesh_scene_curved */
    flesh_scene_material material;
    flesh_objects regions; /* of flesh_scene_region */
    char *material_map;    /* NULL: none */
  } body;
  flesh_objects bodies; /* of flesh_scene_other */
  flesh_objects effects; /* of flesh_effect_entry */
  struct {
    int method, table; /* flesh_method, flesh_table */
    int controlled;    /* whether errors choose the steps; -1: not given */
    double step, end, max_energy_gain;
    flesh_adaptive_options adaptive;
    flesh_method_options options;
  } time;
  struct {
    char *state;
    double velocity[3];
  } start;
  flesh_solver_options solver;
  flesh_output_keys output;
} flesh_scene_keys;

extern const flesh_key flesh_curved_table[];   /* into flesh_scene_curved */
extern const flesh_key flesh_scene_table[];    /* into flesh_scene_keys */
extern const flesh_key flesh_material_table[]; /* into flesh_scene_material */
extern const flesh_key flesh_solver_table[];   /* into flesh_solver_options */
extern const flesh_key flesh_output_table[];   /* into flesh_output_keys */

#endif
