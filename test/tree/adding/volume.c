/* command.c: `flesh volume MESH`: how much a body holds. */
#include "commands.h"

#include <stdio.h>

#include "cli/options.h"
#include "flesh/mesh.h"

int flesh_command_volume(int argc, char **argv)
{
  static const flesh_option none[] = {{0}};
  static const flesh_usage usage = {"volume", "MESH", "Prints the volume of a mesh in m^3.", NULL, 1, 1, none, NULL, 0};
  flesh_mesh *mesh = NULL;
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  const int status = flesh_mesh_read(argv[1], &mesh);
  if (status) return flesh_command_fail("volume", status);
  printf("%.8g\n", flesh_mesh_volume(mesh, flesh_mesh_positions(mesh)));
  flesh_mesh_destroy(&mesh);
  return 0;
}
