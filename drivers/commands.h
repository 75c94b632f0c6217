/* commands.h: the commands of the program. Of each, drivers/NAME/command.c defines flesh_command_NAME, which gets its words
 * from its own name on and returns the exit code. A row brings that file into the build, and the command into help,
 * completion and the manual pages. */
#ifndef FLESH_COMMANDS_H
#define FLESH_COMMANDS_H

/* ROW(name, one line of help), in the order of the help. */
#define FLESH_COMMAND_LIST(ROW) \
  ROW(run, "simulate a scene and write its history, frames and result") \
  ROW(accuracy, "show what accuracy costs in time, method by method") \
  ROW(drift, "compare how well the energies keep the volume") \
  ROW(hardcases, "put solver settings through a battery of hard cases") \
  ROW(bench, "measure flesh against the limits of this machine") \
  ROW(sweep, "run many cases from one spec into one database") \
  ROW(fit, "fit parameters of scenes to measurements") \
  ROW(sensitivity, "differentiate a run's probes by keys of its scene") \
  ROW(material, "compare the energies along simple deformations") \
  ROW(snap, "draw frames of runs side by side") \
  ROW(film, "film runs side by side") \
  ROW(plot, "draw curves of what runs have written") \
  ROW(report, "write results as one HTML file that opens in a browser") \
  ROW(skin, "let a fine surface follow a body's tets") \
  ROW(mesh, "inspect, convert and make meshes") \
  ROW(schema, "document the keys of a scene and the results of a run") \
  ROW(check, "validate a scene and differentiate its effects") \
  ROW(manual, "print a manual page") \
  ROW(completion, "print the script by which bash or zsh completes command lines")

#define FLESH_COMMAND_DECLARE(name, summary) int flesh_command_##name(int argc, char **argv);
FLESH_COMMAND_LIST(FLESH_COMMAND_DECLARE)

#endif
