/* command.c: `flesh slump SCENE`: how much of its volume a body loses, by its stiffness. */
#include "commands.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "cli/interrupt.h"
#include "cli/lists.h"
#include "run/ranks.h"
#include "run/runner.h"
#include "study/settings.h"
#include "study/study.h"

enum { MOST = 16 };

/* NaN where there is none. */
typedef struct figures {
  int steps;
  double max_volume_drift;
} figures;
static const flesh_study_field fields[] = {{"steps", FLESH_FIELD_INT, offsetof(figures, steps)},
                                           {"max_volume_drift", FLESH_FIELD_DOUBLE, offsetof(figures, max_volume_drift)},
                                           {0}};
static const flesh_study_column columns[] = {{.name = "young", .key = "--young"}, {0}};

typedef struct plan {
  flesh_study_options options;
  const char *scene;
  char fingerprint[FLESH_STUDY_FINGERPRINT];
  int count;
  double young[MOST]; /* Pa */
} plan;

static int make_case(const void *data, int number, flesh_study_case *made)
{
  const plan *p = data;
  *made = (flesh_study_case){.scene = p->scene};
  made->values[0] = flesh_study_case_number(made, p->young[number]);
  return FLESH_OK;
}

static json_t *do_case(const void *data, int number, const char *folder)
{
  const plan *p = data;
  figures f = {.max_volume_drift = NAN};
  flesh_figures found = {0};
  flesh_outcome outcome = {0};
  flesh_scene *scene = NULL;
  char young[64];
  (void)folder;
  snprintf(young, sizeof young, "body.material.young=%.17g", p->young[number]);
  const char *const texts[] = {young};
  const int status = flesh_scene_read(p->scene, 1, texts, &scene);
  if (status) return flesh_fields_record("refused", flesh_exit_code(status), flesh_error_text(), NULL);
  const flesh_runner_options options = {.scene_path = p->scene, .no_frames = 1, .quiet = 1};
  flesh_runner_run(scene, &options, &found, &outcome);
  f = (figures){found.steps, found.max_volume_drift};
  json_t *record =
      flesh_fields_record(flesh_outcome_word(&outcome), outcome.exit_code, outcome.message, flesh_fields_json(fields, &f));
  flesh_figures_close(&found);
  flesh_scene_destroy(&scene);
  return record;
}

/* SQL that makes a row for each case, the answer in words, and a picture from the database of the cases
 * (drivers/study/results.h). */
static const char results[] =
    "-- to slump.csv\n"
    "SELECT number + 1 AS \"case\", young, max_volume_drift FROM results JOIN wanted USING (id) ORDER BY number;\n"
    "-- to verdict.txt\n"
    "SELECT printf('The volume changes most at %s Pa.', number('%g', young)) FROM results JOIN wanted USING (id) "
    "ORDER BY max_volume_drift DESC LIMIT 1;\n"
    "-- to slump.gp\n"
    "SELECT plot('slump', 960, 600, 'Change of volume', 'Young''s modulus [Pa]', 'change of volume') || "
    "'plot \"./slump.csv\" using \"young\":\"max_volume_drift\" with lines lw 2';";

static flesh_study study_of(plan *p)
{
  return (flesh_study){.name = "slump", .fingerprint = p->fingerprint,
                       .different = "its scene was another", .columns = columns,
                       .case_count = p->count, .data = p, .make = make_case, .fields = fields, .work = do_case,
                       .results = {results}};
}

int flesh_command_slump(int argc, char **argv)
{
  const char *young = "1e4,1e5";
  plan p = {.options = {.out = "out/slump"}};
  const flesh_option rows[] = {{"young", "LIST", FLESH_OPTION_TEXT, &young, "Young's moduli in Pa (default 1e4,1e5)"},
                               FLESH_STUDY_OPTION_ROWS(&p.options, "slump", "also with further moduli"),
                               FLESH_STUDY_OPTION_JOBS(&p.options),
                               {0}};
  const flesh_usage usage = {"slump", "SCENE", "Shows what volume a body loses by its stiffness.", NULL, 1, 1, rows, NULL,
                             FLESH_EXITS_OF_INTERRUPTS};
  flesh_scene *scene = NULL;
  int count, status, code = flesh_study_open(&p.options, &usage, argc, argv, &count);
  if (code == FLESH_OPTIONS_GO_ON) {
    p.scene = argv[1];
    flesh_interrupt_watch();
    status = flesh_list_numbers("young", young, FLESH_LIST_POSITIVE, MOST, p.young, &p.count);
    if (!status) status = flesh_scene_read(p.scene, 0, NULL, &scene);
    if (!status) status = flesh_study_fingerprint(scene, p.scene, p.fingerprint);
    flesh_scene_destroy(&scene);
    const flesh_study study = study_of(&p);
    code = flesh_study_lead(&study, &p.options, status, NULL);
  }
  flesh_study_close(&p.options);
  return code;
}
