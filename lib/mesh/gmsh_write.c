/* gmsh_write.c: writes Gmsh 4.1, binary in this machine's byte order. Each region is a physical tag of volumes. Each
 * set of tets is a named physical tag: that of a region with just these tets, or else one of its own. Each set of nodes
 * is a named group of points. Tets with the same tags are one volume. */
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/sort.h"
#include "mesh/formats.h"
#include "mesh/gmsh.h"
#include "mesh/inspect.h"

/* The tets of one region that are in the same sets. */
typedef struct volume {
  int tag;    /* physical tag: the region's or a set's */
  int parent; /* volume of these tets without this set; -1: the tag is the region's */
  int child;  /* volume of the tets that are also in the set being added; -1: none yet */
  int tets;
  int number; /* number in the file, from 1; 0: the volume has no tets */
} volume;

typedef struct writing {
  FILE *file;
  const flesh_mesh *mesh;
  int *regions, region_count; /* sorted */
  int *set_tags;              /* [sets] physical tag of a set's tets; 0: none */
  int *of_tet;                /* [tets] volume of each tet */
  volume *volumes;
  int volume_count, room, used; /* used: number of volumes that have tets */
} writing;

static void put_int(FILE *file, int value)
{
  int32_t number = value;
  fwrite(&number, sizeof number, 1, file);
}

static void put_size(FILE *file, int64_t value) { fwrite(&value, sizeof value, 1, file); }

static int no_memory(void) { return flesh_fail(FLESH_ERR_MEMORY, "out of memory for the regions of a mesh"); }

/* Returns the index of a region; -1: no region has this tag. */
static int find_region(const writing *w, int tag)
{
  const int *found = bsearch(&tag, w->regions, (size_t)w->region_count, sizeof tag, flesh_compare_int);
  return found ? (int)(found - w->regions) : -1;
}

/* Returns the region whose tets are exactly those of the set; 0: there is none, or its tag cannot be named, as a
 * negative tag stands for the reversed group of the positive one. */
static int region_of_set(const writing *w, const flesh_members *tets)
{
  const int region = w->mesh->regions[tets->values[0]];
  for (int k = 1; k < tets->count; k++)
    if (w->mesh->regions[tets->values[k]] != region) return 0;
  return region > 0 && find_region(w, -region) < 0 && w->volumes[find_region(w, region)].tets == tets->count ? region : 0;
}

/* Gives each set of tets its tag: that of its region, if no other set has taken it, or one that no region has. */
static void choose_tags(writing *w)
{
  const flesh_mesh_sets *sets = &w->mesh->sets;
  int next = 1;
  for (int k = 0; k < sets->count; k++) {
    if (!sets->sets[k].tets.count) continue;
    int tag = region_of_set(w, &sets->sets[k].tets);
    for (int other = 0; other < k && tag; other++)
      if (w->set_tags[other] == tag) tag = 0;
    if (!tag) {
      while (find_region(w, next) >= 0 || find_region(w, -next) >= 0) next++;
      tag = next++;
    }
    w->set_tags[k] = tag;
  }
}

static int add_volume(writing *w, int tag, int parent)
{
  if (!flesh_grow(&w->volumes, sizeof *w->volumes, w->volume_count, &w->room)) return no_memory();
  w->volumes[w->volume_count++] = (volume){.tag = tag, .parent = parent, .child = -1};
  return FLESH_OK;
}

/* Moves the tets of a set to volumes that have its tag in addition. */
static int add_set(writing *w, const flesh_members *tets, int tag)
{
  const int before = w->volume_count;
  int status = FLESH_OK;
  for (int k = 0; k < tets->count && !status; k++) {
    int *of = &w->of_tet[tets->values[k]];
    if (w->volumes[*of].child < 0) {
      w->volumes[*of].child = w->volume_count;
      status = add_volume(w, tag, *of);
      if (status) break;
    }
    w->volumes[*of].tets--;
    *of = w->volumes[*of].child;
    w->volumes[*of].tets++;
  }
  for (int v = 0; v < before; v++) w->volumes[v].child = -1;
  return status;
}

/* Finds the volume of each tet. */
static int sort_tets(writing *w)
{
  const flesh_mesh *mesh = w->mesh;
  int status = FLESH_OK;
  for (int r = 0; r < w->region_count && !status; r++) status = add_volume(w, w->regions[r], -1);
  if (status) return status;
  for (int t = 0; t < mesh->tets; t++) w->volumes[w->of_tet[t] = find_region(w, mesh->regions[t])].tets++;
  choose_tags(w);
  for (int k = 0; k < mesh->sets.count && !status; k++)
    if (w->set_tags[k] && find_region(w, w->set_tags[k]) < 0)
      status = add_set(w, &mesh->sets.sets[k].tets, w->set_tags[k]);
  for (int v = 0; v < w->volume_count; v++)
    if (w->volumes[v].tets) w->volumes[v].number = ++w->used;
  return status;
}

/* Returns whether the set is written as a group of points: it has nodes, or no members at all. */
static int has_points(const flesh_mesh_set *set) { return set->nodes.count || !set->tets.count; }

static void write_names(const writing *w)
{
  const flesh_mesh_sets *sets = &w->mesh->sets;
  int names = 0;
  for (int k = 0; k < sets->count; k++) names += has_points(&sets->sets[k]) + (w->set_tags[k] != 0);
  if (!names) return;
  fprintf(w->file, "$PhysicalNames\n%d\n", names);
  for (int k = 0; k < sets->count; k++) {
    if (has_points(&sets->sets[k])) fprintf(w->file, "0 %d \"%s\"\n", k + 1, sets->sets[k].name);
    if (w->set_tags[k]) fprintf(w->file, "3 %d \"%s\"\n", w->set_tags[k], sets->sets[k].name);
  }
  fputs("$EndPhysicalNames\n", w->file);
}

static void write_volume(const writing *w, const volume *v, const flesh_mesh_info *info)
{
  const volume *region = v;
  int tags = 1;
  for (; region->parent >= 0; region = &w->volumes[region->parent]) tags++;
  put_int(w->file, v->number);
  fwrite(info->low, sizeof *info->low, 3, w->file);
  fwrite(info->high, sizeof *info->high, 3, w->file);
  put_size(w->file, tags);
  put_int(w->file, region->tag); /* readers take the first tag as the region */
  for (; v->parent >= 0; v = &w->volumes[v->parent]) put_int(w->file, v->tag);
  put_size(w->file, 0);
}

static void write_entities(const writing *w, int points)
{
  const flesh_mesh_sets *sets = &w->mesh->sets;
  flesh_mesh_info info;
  flesh_mesh_inspect(w->mesh, &info);
  fputs("$Entities\n", w->file);
  put_size(w->file, points), put_size(w->file, 0), put_size(w->file, 0), put_size(w->file, w->used);
  for (int k = 0; k < sets->count; k++) {
    if (!sets->sets[k].nodes.count) continue;
    put_int(w->file, k + 1);
    fwrite(w->mesh->positions + 3 * (size_t)sets->sets[k].nodes.values[0], sizeof(double), 3, w->file);
    put_size(w->file, 1);
    put_int(w->file, k + 1);
  }
  for (int v = 0; v < w->volume_count; v++)
    if (w->volumes[v].number) write_volume(w, &w->volumes[v], &info);
  fputs("\n$EndEntities\n", w->file);
}

static void write_nodes(const writing *w)
{
  const int nodes = w->mesh->nodes;
  fputs("$Nodes\n", w->file);
  put_size(w->file, 1), put_size(w->file, nodes), put_size(w->file, 1), put_size(w->file, nodes);
  put_int(w->file, 3), put_int(w->file, 1), put_int(w->file, 0), put_size(w->file, nodes);
  for (int n = 0; n < nodes; n++) put_size(w->file, n + 1);
  fwrite(w->mesh->positions, sizeof *w->mesh->positions, 3 * (size_t)nodes, w->file);
  fputs("\n$EndNodes\n", w->file);
}

/* Returns the number of consecutive tets of one volume from `first`; they form one block, which keeps their order. */
static int run_length(const writing *w, int first)
{
  int end = first;
  while (end < w->mesh->tets && w->of_tet[end] == w->of_tet[first]) end++;
  return end - first;
}

static void write_elements(const writing *w, int points)
{
  const flesh_mesh *mesh = w->mesh;
  const flesh_mesh_sets *sets = &mesh->sets;
  int64_t elements = mesh->tets;
  int blocks = points;
  for (int t = 0; t < mesh->tets; t += run_length(w, t)) blocks++;
  for (int k = 0; k < sets->count; k++) elements += sets->sets[k].nodes.count;
  fputs("$Elements\n", w->file);
  put_size(w->file, blocks), put_size(w->file, elements), put_size(w->file, 1), put_size(w->file, elements);
  for (int t = 0; t < mesh->tets;) {
    int count = run_length(w, t);
    put_int(w->file, 3), put_int(w->file, w->volumes[w->of_tet[t]].number);
    put_int(w->file, mesh->edge_nodes ? FLESH_GMSH_TET10 : FLESH_GMSH_TET4);
    put_size(w->file, count);
    for (int end = t + count; t < end; t++) {
      int n[10], size = flesh_mesh_nodes_in_order(mesh, t, flesh_gmsh_order, n);
      put_size(w->file, t + 1);
      for (int i = 0; i < size; i++) put_size(w->file, n[i] + 1);
    }
  }
  int64_t element = mesh->tets;
  for (int k = 0; k < sets->count; k++) {
    const flesh_members *nodes = &sets->sets[k].nodes;
    if (!nodes->count) continue;
    put_int(w->file, 0), put_int(w->file, k + 1), put_int(w->file, FLESH_GMSH_POINT), put_size(w->file, nodes->count);
    for (int i = 0; i < nodes->count; i++) put_size(w->file, ++element), put_size(w->file, nodes->values[i] + 1);
  }
  fputs("\n$EndElements\n", w->file);
}

static int check_names(const flesh_mesh_sets *sets)
{
  for (int k = 0; k < sets->count; k++)
    if (strchr(sets->sets[k].name, '"') || !*sets->sets[k].name)
      return flesh_fail(FLESH_ERR_ARGUMENT, "the set '%s' has %s, which a .msh file cannot hold; rename the set, or write a "
                        ".mesh, which has no sets", sets->sets[k].name, *sets->sets[k].name ? "a \" in its name" : "no name");
  return FLESH_OK;
}

int flesh_gmsh_write(FILE *file, const flesh_mesh *mesh)
{
  const flesh_mesh_sets *sets = &mesh->sets;
  writing w = {.file = file, .mesh = mesh};
  int points = 0, status = check_names(sets);
  if (status) return status;
  w.region_count = flesh_mesh_region_list(mesh, &w.regions);
  w.set_tags = flesh_calloc((size_t)sets->count + 1, sizeof *w.set_tags);
  w.of_tet = flesh_calloc((size_t)mesh->tets, sizeof *w.of_tet);
  status = w.regions && w.set_tags && w.of_tet ? sort_tets(&w) : no_memory();
  if (!status) {
    for (int k = 0; k < sets->count; k++) points += sets->sets[k].nodes.count > 0;
    fputs("$MeshFormat\n4.1 1 8\n", file);
    put_int(file, 1);
    fputs("\n$EndMeshFormat\n", file);
    write_names(&w);
    write_entities(&w, points);
    write_nodes(&w);
    write_elements(&w, points);
  }
  free(w.regions);
  flesh_free(w.set_tags);
  flesh_free(w.of_tet);
  flesh_free(w.volumes);
  return status;
}
