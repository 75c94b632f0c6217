/* scene.h: scenes: YAML or JSON text made into a mesh, a system and the options of a run.
 *
 * Every key stands once in a table with type, unit, default and doc; parsing, validation, `flesh schema` and
 * the resolved scene come from it. Unknown keys are refused with the nearest known one. */
#ifndef FLESH_SCENE_H
#define FLESH_SCENE_H

#include "flesh/integrator.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_scene flesh_scene;

/* Reads and builds. `overrides` [count] are "path.to.key=value" strings applied before validation (value is
 * YAML; list items by index, effects also by name: "effects.gravity.acceleration=[0,0,0]"). Paths in the scene are
 * relative to its file; paths in overrides to the working directory. FLESH_ERR_ARGUMENT for a bad scene or
 * override ("file:line:column: key is value; what is valid"), FLESH_ERR_FILE for a bad file or mesh. Returns new. */
FLESH_API int flesh_scene_read(const char *path, int count, const char *const *overrides,
                               flesh_scene **scene);
/* NULL-safe; sets *scene to NULL. */
FLESH_API void flesh_scene_destroy(flesh_scene **scene);

/* The parts of a scene belong to it and live as long. */
FLESH_API const flesh_mesh *flesh_scene_mesh(const flesh_scene *scene);
FLESH_API const char *flesh_scene_mesh_path(const flesh_scene *scene);
FLESH_API const flesh_body *flesh_scene_body(const flesh_scene *scene);
FLESH_API const flesh_system *flesh_scene_system(const flesh_scene *scene);
FLESH_API const flesh_solver_options *flesh_scene_solver(const flesh_scene *scene);
FLESH_API int flesh_scene_material_count(const flesh_scene *scene);

typedef struct flesh_scene_time {
  flesh_method method; /* FLESH_METHOD_STATIC when the scene has no inertia */
  double step, end;    /* s */
} flesh_scene_time;
FLESH_API const flesh_scene_time *flesh_scene_times(const flesh_scene *scene);

typedef struct flesh_scene_output {
  int frame_interval; /* steps between frames; 0: no frames */
  int seed;
} flesh_scene_output;
FLESH_API const flesh_scene_output *flesh_scene_outputs(const flesh_scene *scene);

/* The start state [3*n] each: the scene's `start: state:` file, else rest positions and the scene's start
 * velocity (0). */
FLESH_API void flesh_scene_start(const flesh_scene *scene, flesh_state *state);

/* A state file: rows `x y z vx vy vz`, one per node, '#' comments; a first comment `# t <seconds>` gives the
 * time (else 0). Errors name file and line. */
FLESH_API int flesh_state_read(const char *path, int nodes, flesh_state *state);
/* Writes it with 17 significant digits, whole or not at all. */
FLESH_API int flesh_state_write(const char *path, int nodes, const flesh_state *state);

/* The resolved scene: every key with its value in force, absolute mesh path, as YAML that reproduces the run.
 * Whole or not at all. */
FLESH_API int flesh_scene_write(const flesh_scene *scene, const char *path);

/* The documentation of every key: Markdown or JSON Schema. Returns new text in *text, freed by the caller with
 * free(). */
typedef enum flesh_schema_format { FLESH_SCHEMA_MARKDOWN, FLESH_SCHEMA_JSON } flesh_schema_format;
FLESH_API int flesh_scene_schema(flesh_schema_format format, char **text);

#ifdef __cplusplus
}
#endif
#endif
