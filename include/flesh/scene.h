/* scene.h: scenes, YAML or JSON text from which a mesh, a system and the options of a run are made.
 *
 * Every key is defined once in a table with type, unit, default and doc; parsing, validation, `flesh schema` and the
 * resolved scene use it. Unknown keys are refused with the nearest known one. Functions that return no status cannot
 * fail. */
#ifndef FLESH_SCENE_H
#define FLESH_SCENE_H

#include "flesh/probe.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flesh_scene flesh_scene;

/* Reads a scene and builds it. `overrides` [count] are "path.to.key=value" strings, applied in their order before
 * validation; the value is YAML:
 *
 *   body.material.young=1e5             a key; missing mappings on its path are added
 *   body.regions[0].density=900         a list's item, from 0; one past the end appends
 *   effects.gravity.acceleration[2]=0   the first effect of that name, appended when there is none
 *   effects.pin[1].until=2              the second of the effects named pin
 *   effects[3].pin.until=2              the fourth effect
 *   effects.inertia=null                null removes the key, item or effect
 *
 * A material takes one pair of constants, mu and lambda or young and poisson; when overrides complete a second pair,
 * the pair that was given last counts. Paths in the scene are relative to its file, paths in overrides to the working
 * directory. FLESH_ERR_ARGUMENT for a bad scene or override ("file:line:column: key is value; what is valid", "--set
 * path=value: ..."), FLESH_ERR_FILE for a bad file or mesh. Returns new. Further errors: FLESH_ERR_MEMORY, and the
 * status of flesh_scene_set_stop's function. */
FLESH_API int flesh_scene_read(const char *path, int count, const char *const *overrides,
                               flesh_scene **scene);
/* Reads a scene from `text` in memory: `path` is its name in messages, and relative paths in it are relative to the
 * folder of `path`, which need not exist. Returns new. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_FILE, FLESH_ERR_MEMORY. */
FLESH_API int flesh_scene_read_text(const char *text, const char *path, int count,
                                    const char *const *overrides, flesh_scene **scene);
/* Sets a function that is called often while this thread reads scenes, and must be quick: a negative status ends
 * flesh_scene_read and flesh_scene_read_text with it. NULL, as at the start: not called. `data` is borrowed. Cannot
 * fail. */
FLESH_API void flesh_scene_set_stop(int (*stop)(void *data), void *data);

/* NULL-safe; sets *scene to NULL. */
FLESH_API void flesh_scene_destroy(flesh_scene **scene);

/* Returns a warning about a scene that was read, as a sentence (keys without effect beside others, faces of a mesh's
 * boundary that lie near a surface of `curved` but not on it); NULL if there is none. Belongs to the scene. Cannot
 * fail. */
FLESH_API const char *flesh_scene_warning(const flesh_scene *scene);

/* Return the parts of a scene, which belong to it and live as long. */
FLESH_API const flesh_mesh *flesh_scene_mesh(const flesh_scene *scene);
FLESH_API const flesh_body *flesh_scene_body(const flesh_scene *scene);
FLESH_API const flesh_system *flesh_scene_system(const flesh_scene *scene);
FLESH_API const flesh_solver_options *flesh_scene_solver(const flesh_scene *scene);
/* Returns the number of materials of flesh_scene_body: the body's first, then those of its regions; 0 without
 * elasticity. Cannot fail. */
FLESH_API int flesh_scene_material_count(const flesh_scene *scene);

typedef struct flesh_scene_time {
  flesh_method method; /* FLESH_METHOD_STATIC when the scene has no inertia */
  double step, end;    /* s */
  double max_energy_gain; /* for flesh_integrator_set_max_energy_gain */
  flesh_method_options options;
  flesh_adaptive_options adaptive; /* for flesh_integrator_set_adaptive */
} flesh_scene_time;
/* Returns the scene's time settings, owned by the scene. */
FLESH_API const flesh_scene_time *flesh_scene_times(const flesh_scene *scene);

/* Camera of pictures. Members that are NaN are fitted to the body. Azimuth and elevation refer to axes rotated by the
 * smallest rotation of z onto `up`: with up = z the camera looks along y at azimuth 0 and along -x at 90, with up = y
 * along -z and -x. */
typedef struct flesh_camera {
  double up[3];         /* points upwards in the picture; NaN or 0: against gravity, or z without gravity */
  double azimuth;       /* degrees, camera's position about `up` */
  double elevation;     /* degrees, camera's position above the horizon */
  double target[3];     /* m, centre of the picture */
  double height;        /* m, height of the visible region at the target */
  double field_of_view; /* degrees, from the picture's lower to its upper edge; 0: parallel projection */
} flesh_camera;

typedef struct flesh_scene_output {
  int frame_interval; /* steps between frames; 0: no frames */
  int seed;
  struct {
    char *surface;    /* absolute path; NULL: no skin */
    unsigned formats; /* FLESH_SKIN_OBJ ..., see skin.h */
  } skin;
  unsigned fields, fields_at; /* for flesh_frames_set_fields */
  flesh_camera camera;
} flesh_scene_output;
/* Returns the scene's output settings, owned by the scene. */
FLESH_API const flesh_scene_output *flesh_scene_outputs(const flesh_scene *scene);

/* Returns the scene's probes [*count], prepared, for flesh_probes_create; NULL and 0 if it has none. Owned by the
 * scene. Cannot fail. */
FLESH_API const flesh_probe *flesh_scene_probes(const flesh_scene *scene, int *count);

/* Fills the caller's state->x, v [3*n each], and t: from the scene's start file, or else with the rest positions, the
 * scene's start velocity and 0; also the multipliers and internal variables for which the state has room. */
FLESH_API void flesh_scene_start(const flesh_scene *scene, flesh_state *state);

/* Writes the resolved scene: every key with its value in force and an absolute mesh path, as YAML that reproduces the
 * run. A partial file is never left. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_scene_write(const flesh_scene *scene, const char *path);

/* Formats of the documentation of all keys: Markdown, JSON Schema, the manual page flesh-scene(5) (roff), or the
 * paths of the keys alone, one a line. */
typedef enum flesh_schema_format {
  FLESH_SCHEMA_MARKDOWN,
  FLESH_SCHEMA_JSON,
  FLESH_SCHEMA_MAN,
  FLESH_SCHEMA_PATHS
} flesh_schema_format;
/* Writes the documentation of all keys as new text into *text, which the caller frees with free(). Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_scene_schema(flesh_schema_format format, char **text);

#ifdef __cplusplus
}
#endif
#endif
