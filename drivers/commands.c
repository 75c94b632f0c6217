/* commands.c: the list of the program's commands. */
#include "commands.h"

#include <stddef.h>

#include "accuracy/command.h"
#include "bench/command.h"
#include "check/command.h"
#include "drift/command.h"
#include "film/command.h"
#include "hardcases/command.h"
#include "manual/command.h"
#include "material/command.h"
#include "mesh/command.h"
#include "plot/command.h"
#include "report/command.h"
#include "run/command.h"
#include "schema/command.h"
#include "skin/command.h"
#include "snap/command.h"
#include "sweep/command.h"

const char flesh_about[] = "Dynamics of soft, nearly incompressible bodies.";

/* A command is a row here, an include above, its files in drivers/meson.build and its name in drivers/manual. */
const flesh_subcommand flesh_commands[] = {
    {"run", "simulate a scene and write its history, frames and result", flesh_command_run},
    {"accuracy", "show what accuracy costs in time, method by method", flesh_command_accuracy},
    {"drift", "compare how well the energies keep the volume", flesh_command_drift},
    {"hardcases", "put solver settings through a battery of hard cases", flesh_command_hardcases},
    {"bench", "measure flesh against the limits of this machine", flesh_command_bench},
    {"sweep", "run many cases from one spec into one database", flesh_command_sweep},
    {"material", "compare the energies along simple deformations", flesh_command_material},
    {"snap", "draw frames of runs side by side", flesh_command_snap},
    {"film", "film runs side by side", flesh_command_film},
    {"plot", "draw curves of what runs have written", flesh_command_plot},
    {"report", "write results as one HTML file that opens in a browser", flesh_command_report},
    {"skin", "let a fine surface follow a body's tets", flesh_command_skin},
    {"mesh", "inspect, convert and make meshes", flesh_command_mesh},
    {"schema", "document the keys of a scene", flesh_command_schema},
    {"check", "validate a scene and differentiate its effects", flesh_command_check},
    {"manual", "print a manual page", flesh_command_manual},
    {"completion", "print what bash or zsh completes command lines with", flesh_command_completion},
    {NULL, NULL, NULL}};
