// TEST quick
/* test_mesh_sets.c: the formats recognised by file name, and the named sets of meshes: their members, and their copies
 * in refined meshes, in meshes of another order and in parts. */
#include "mesh_files.h"

#include "mesh/mesh.h"

#define POINTS "1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1.5, 0\n40, 0, 0, 1\n5, 1, 1, 1\n"

/* Two tets on a face. */
static const char deck[] = "*Heading\n two tets, and a deck's usual lines\n** a comment\n*Node, nset=All\n" POINTS
                           "*ELEMENT, TYPE=S3, ELSET=skin\n9, 1, 2, 3,\n"
                           "*Element, type=C3D4, elset=\"the lower one\"\n100, 1, 2, 3, 40\n"
                           "*ELEMENT, TYPE=C3D4H,\n ELSET=upper\n200, 2, 3, 40, 5\n"
                           "*NSET, NSET=ends\n1,\n5, 1\n*nset, nset=ends\n40\n*NSET, NSET=range, GENERATE\n2, 100, 2\n"
                           "*NSET, NSET=both\nENDS, range\n"
                           "*ELSET, ELSET=tets\n9, 100, 200\n*ELSET, ELSET=some\n\"the lower one\"\n"
                           "*MATERIAL, NAME=rubber\n*ELASTIC\n1e5, 0.45\n";

static void check_set(const flesh_mesh *mesh, const char *name, const int *nodes, int node_count, const int *tets,
                      int tet_count)
{
  const int k = flesh_mesh_sets_find(&mesh->sets, name, strlen(name));
  CHECK(k >= 0);
  if (k < 0) return;
  const flesh_mesh_set *set = &mesh->sets.sets[k];
  CHECK(set->nodes.count == node_count && set->tets.count == tet_count);
  if (set->nodes.count != node_count || set->tets.count != tet_count)
    printf("# '%s' has %d nodes, %d tets\n", name, set->nodes.count, set->tets.count);
  for (int i = 0; i < node_count && i < set->nodes.count; i++) CHECK(set->nodes.values[i] == nodes[i]);
  for (int i = 0; i < tet_count && i < set->tets.count; i++) CHECK(set->tets.values[i] == tets[i]);
}

#define LIST(...) (const int[]){__VA_ARGS__}, sizeof((const int[]){__VA_ARGS__}) / sizeof(int)
#define NONE      NULL, 0

static void decks_have_sets_and_regions(void)
{
  flesh_mesh *mesh;
  char sections[2048];
  CHECK_OK(flesh_mesh_read(write_text("d.inp", deck), &mesh));
  CHECK(mesh && flesh_mesh_node_count(mesh) == 5 && flesh_mesh_tet_count(mesh) == 2);
  if (!mesh) return;
  CHECK(!memcmp(flesh_mesh_tets(mesh), (int[]){0, 1, 2, 3}, sizeof(int[4])));
  CHECK(mesh->regions[0] == 1 && mesh->regions[1] == 2);
  check_set(mesh, "All", LIST(0, 1, 2, 3, 4), NONE);
  check_set(mesh, "skin", LIST(0, 1, 2), NONE); /* the S3 is no tet: it contributes its nodes */
  check_set(mesh, "the lower one", NONE, LIST(0));
  check_set(mesh, "upper", NONE, LIST(1));
  check_set(mesh, "ends", LIST(0, 3, 4), NONE);
  check_set(mesh, "range", LIST(1, 3), NONE); /* missing elements are left out */
  check_set(mesh, "both", LIST(0, 1, 3, 4), NONE);
  check_set(mesh, "tets", LIST(0, 1, 2), LIST(0, 1));
  check_set(mesh, "some", NONE, LIST(0));
  CHECK(flesh_mesh_sets_find(&mesh->sets, "nothing", 7) == -1 && mesh->sets.count == 9);
  flesh_mesh_destroy(&mesh);
  snprintf(sections, sizeof sections, "%s*SOLID SECTION, ELSET=UPPER, MATERIAL=rubber\n*SOLID SECTION, ELSET=some\n", deck);
  CHECK_OK(flesh_mesh_read(write_text("s.inp", sections), &mesh));
  CHECK(mesh && mesh->regions[0] == 2 && mesh->regions[1] == 1);
  flesh_mesh_destroy(&mesh);
  snprintf(sections, sizeof sections, "%s*SOLID SECTION, ELSET=UPPER, MATERIAL=rubber\n", deck);
  CHECK_OK(flesh_mesh_read(write_text("o.inp", sections), &mesh));
  CHECK(mesh && mesh->regions[0] == 0 && mesh->regions[1] == 1); /* a tet without a section has none */
  flesh_mesh_destroy(&mesh);
}

/* The faces of C3D4 and C3D10: S1 is 1 2 3, S2 is 1 4 2, S3 is 2 4 3, S4 is 3 4 1 (CalculiX CrunchiX User's Manual). */
static void surfaces_are_sets_of_nodes(void)
{
  flesh_mesh *mesh;
  char text[2048];
  snprintf(text, sizeof text, "%s*SURFACE, NAME=bottom\n 100, S1\n 9, E1\n*SURFACE, NAME=outside\n skin, SNEG\n*Surface, type=ELEMENT, name=\"side\"\n"
                              "\"The lower one\", s4\n200, S3\n*SURFACE, NAME=top, TYPE=NODE\nends, 1.0\n2, 0.5\n"
                              "*SURFACE, NAME=ground, TYPE=SEGMENTS\nSTART, 0, 0\nLINE, 1, 0\n*SURFACE, NAME=Bottom\nupper, S2\n", deck);
  CHECK_OK(flesh_mesh_read(write_text("f.inp", text), &mesh));
  if (!mesh) return;
  check_set(mesh, "bottom", LIST(0, 1, 2, 4), NONE);
  check_set(mesh, "outside", LIST(0, 1, 2), NONE);
  check_set(mesh, "side", LIST(0, 2, 3, 4), NONE);
  check_set(mesh, "top", LIST(0, 1, 3, 4), NONE);
  CHECK(mesh->sets.count == 13);
  flesh_mesh_destroy(&mesh);
  const char *points = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,.5,0,0\n6,.5,.5,0\n7,0,.5,0\n8,0,0,.5\n9,.5,0,.5\n10,0,.5,.5\n";
  snprintf(text, sizeof text, "*SURFACE, NAME=S1\nall, S1\n*SURFACE, NAME=S2\nall, S2\n*SURFACE, NAME=S3\nall, S3\n*SURFACE, NAME=S4\n"
                              "all, S4\n%s*ELEMENT, TYPE=C3D10, ELSET=all\n1,1,2,3,4,5,6,7,8,9,10\n", points);
  CHECK_OK(flesh_mesh_read(write_text("q.inp", text), &mesh));
  if (!mesh) return;
  check_set(mesh, "S1", LIST(0, 1, 2, 4, 5, 6), NONE);
  check_set(mesh, "S2", LIST(0, 1, 3, 4, 7, 8), NONE);
  check_set(mesh, "S3", LIST(1, 2, 3, 5, 8, 9), NONE);
  check_set(mesh, "S4", LIST(0, 2, 3, 6, 7, 9), NONE);
  const flesh_named_set all = flesh_mesh_set_at(mesh, 0);
  CHECK(flesh_mesh_set_count(mesh) == 5 && all.tet_count == 1 && all.tets[0] == 0 && all.node_count == 0);
  CHECK_TEXT(all.name, "all");
  CHECK(flesh_mesh_set_at(mesh, 4).node_count == 6 && flesh_mesh_set_at(mesh, 4).nodes[5] == 9);
  flesh_mesh_destroy(&mesh);
}

static void vega_files_have_sets_and_regions(void)
{
  flesh_mesh *mesh;
  const char *before = "# a mesh\n*VERTICES\n5 3 0 0\n1 0 0 0\n2 1 0 0\n3, 0, 1.5, 0\n4\t0 0 1\n5 1 1 1\n\n*ELEMENTS\nTET\n2 4 0\n"
                       "1 1 2 3 4\n2 2 3 4 5\n";
  const char *rest = "*MATERIAL soft\nENU, 1000, 1e5, 0.45\n*REGION\nallElements, soft\n*REGION\nupper, soft\n*SET upper\n2\n"
                     "*SET both\n1,\n2,\n";
  char text[1024];
  snprintf(text, sizeof text, "%s%s", before, rest);
  CHECK_OK(flesh_mesh_read(write_text("v.veg", text), &mesh));
  CHECK(mesh && flesh_mesh_node_count(mesh) == 5 && mesh->regions[0] == 1 && mesh->regions[1] == 2);
  CHECK(mesh && !memcmp(flesh_mesh_tets(mesh), (int[]){0, 1, 2, 3}, sizeof(int[4])));
  if (mesh) check_set(mesh, "upper", NONE, LIST(1));
  if (mesh) check_set(mesh, "both", NONE, LIST(0, 1));
  flesh_mesh_destroy(&mesh);
  CHECK_OK(flesh_mesh_read(write_text("w.veg", "*VERTICES\n4 3 0 0\n0 0 0 0\n1 1 0 0\n2 0 1 0\n3 0 0 1\n*ELEMENTS\nTETS\n1 4 0\n"
                                               "0 0 1 2 3\n*SET one\n0\n"), &mesh));
  CHECK(mesh && mesh->regions[0] == 0 && !memcmp(flesh_mesh_tets(mesh), (int[]){0, 1, 2, 3}, sizeof(int[4])));
  if (mesh) check_set(mesh, "one", NONE, LIST(0));
  flesh_mesh_destroy(&mesh);
}

#define NAMES "$PhysicalNames\n5\n3 7 \"again\"\n0 1 \"tip\"\n2 4 \"the base\"\n3 9 \"body\"\n2 5 \"unused\"\n$EndPhysicalNames\n"

static void gmsh_groups_are_sets(void)
{
  flesh_mesh *mesh[2];
  CHECK_OK(flesh_mesh_read(write_text("g22.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" NAMES
                                                 "$Nodes\n4\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n$EndNodes\n"
                                                 "$Elements\n4\n1 15 2 1 1 40\n2 2 2 4 1 10 30 20\n3 4 2 9 1 10 20 30 40\n"
                                                 "4 4 2 7 1 10 20 30 40\n" /* repeated in another group */
                                                 "$EndElements\n"), &mesh[0]));
  /* Negative groups, -4 and -9, have the opposite orientation of their surface and volume. */
  CHECK_OK(flesh_mesh_read(write_text("g41.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" NAMES
                                                 "$Entities\n1 0 1 1\n7 0 0 1 1 1\n3 0 0 0 1 1 0 2 6 -4 0\n1 0 0 0 1 1 1 2 -9 7 0\n"
                                                 "$EndEntities\n$Nodes\n1 4 10 40\n3 1 0 4\n10\n20\n30\n40\n0 0 0\n1 0 0\n0 1 0\n"
                                                 "0 0 1\n$EndNodes\n$Elements\n3 3 1 3\n0 7 15 1\n1 40\n2 3 2 1\n2 10 30 20\n"
                                                 "3 1 4 1\n3 10 20 30 40\n$EndElements\n"), &mesh[1]));
  for (int m = 0; m < 2; m++) {
    CHECK(mesh[m] && mesh[m]->regions[0] == 9);
    if (!mesh[m]) continue;
    check_set(mesh[m], "tip", LIST(3), NONE);
    check_set(mesh[m], "the base", LIST(0, 1, 2), NONE);
    check_set(mesh[m], "body", NONE, LIST(0));
    check_set(mesh[m], "again", NONE, LIST(0));
    check_set(mesh[m], "unused", NONE, NONE);
    flesh_mesh_destroy(&mesh[m]);
  }
  /* Files written by gmsh itself, in either format, ASCII and binary, in parts, with ten nodes: two boxes of 24
   * tets. */
  static const char *const names[] = {"22_ascii", "22_binary", "41_ascii", "41_binary", "41_parts", "order2"};
  for (int f = 0; f < 6; f++) {
    char path[64];
    snprintf(path, sizeof path, "reference/meshes/two_boxes_%s.msh", names[f]);
    CHECK_OK(flesh_mesh_read(path, &mesh[0]));
    CHECK(mesh[0] && mesh[0]->sets.count == 2);
    for (int k = 0; k < 2 && mesh[0] && mesh[0]->sets.count == 2; k++) {
      const flesh_mesh_set *set = &mesh[0]->sets.sets[k];
      CHECK(!strcmp(set->name, k ? "right" : "left") && set->tets.count == 24 && set->nodes.count == 0);
      for (int t = 0; t < set->tets.count; t++) CHECK(mesh[0]->regions[set->tets.values[t]] == (k ? 9 : 7));
    }
    flesh_mesh_destroy(&mesh[0]);
  }
}

/* Checks that a mesh written as a .msh and read again has its sets, in their order, and its regions. */
static void check_written(const flesh_mesh *mesh)
{
  flesh_mesh *again;
  CHECK_OK(flesh_mesh_write(mesh, in_work_folder("again.msh")));
  CHECK_OK(flesh_mesh_read(in_work_folder("again.msh"), &again));
  if (!again) return;
  CHECK(again->tets == mesh->tets && !memcmp(again->regions, mesh->regions, sizeof(int) * (size_t)mesh->tets));
  CHECK(!memcmp(again->tet_nodes, mesh->tet_nodes, sizeof(int[4]) * (size_t)mesh->tets) && again->sets.count == mesh->sets.count);
  for (int k = 0; k < mesh->sets.count && k < again->sets.count; k++) {
    const flesh_mesh_set *set = &mesh->sets.sets[k];
    CHECK_TEXT(again->sets.sets[k].name, set->name);
    check_set(again, set->name, set->nodes.values, set->nodes.count, set->tets.values, set->tets.count);
  }
  flesh_mesh_destroy(&again);
}

static void written_files_have_sets(void)
{
  flesh_mesh *mesh, *box;
  char text[2048];
  CHECK_OK(flesh_mesh_read(write_text("d.inp", deck), &mesh));
  if (mesh) check_written(mesh);
  flesh_mesh_destroy(&mesh);
  CHECK_OK(flesh_mesh_read("reference/meshes/two_boxes_order2.msh", &mesh));
  if (mesh) check_written(mesh);
  flesh_mesh_destroy(&mesh);
  /* Sets that overlap each other and regions; two with the same tets; a region's tets; a set of nodes and tets; an
   * empty one. */
  CHECK_OK(flesh_mesh_box((int[]){2, 1, 1}, (double[]){2, 1, 1}, (double[]){0, 0, 0}, &box));
  int length = snprintf(text, sizeof text, "*NODE\n");
  for (int i = 0; i < box->nodes; i++)
    length += snprintf(text + length, sizeof text - (size_t)length, "%d,%g,%g,%g\n", i + 1, box->positions[3 * i],
                       box->positions[3 * i + 1], box->positions[3 * i + 2]);
  for (int t = 0; t < box->tets; t++) {
    const int *n = box->tet_nodes + 4 * t;
    if (t % 6 == 0) length += snprintf(text + length, sizeof text - (size_t)length, "*ELEMENT,TYPE=C3D4,ELSET=r%d\n", t / 6);
    length += snprintf(text + length, sizeof text - (size_t)length, "%d,%d,%d,%d,%d\n", t + 1, n[0] + 1, n[1] + 1, n[2] + 1, n[3] + 1);
  }
  snprintf(text + length, sizeof text - (size_t)length, "*ELSET,ELSET=odd,GENERATE\n1,11,2\n*ELSET,ELSET=like r1\nr1\n*ELSET,ELSET=middle\n"
           "4,5,6,7,8\n*NSET,NSET=middle\n1,5\n*NSET,NSET=empty,GENERATE\n90,91\n*ELSET,ELSET=all\nr0,r1\n");
  CHECK_OK(flesh_mesh_read(write_text("o.inp", text), &mesh));
  CHECK(mesh && mesh->sets.count == 7 && mesh->sets.sets[4].tets.count == 5 && mesh->sets.sets[4].nodes.count == 2);
  if (mesh) check_written(mesh);
  for (int k = 0; mesh && k < mesh->tets; k++) mesh->regions[k] -= 2; /* -1 and 0: a set with the tag 1 would reverse
                                                                       * the first */
  if (mesh) check_written(mesh);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&box);
  snprintf(text, sizeof text, "*VERTICES\n4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n*ELEMENTS\nTET\n1 4 0\n1 1 2 3 4\n*SET a\"b\n1\n");
  CHECK_OK(flesh_mesh_read(write_text("n.veg", text), &mesh));
  CHECK(mesh && flesh_mesh_write(mesh, in_work_folder("n.msh")) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "the set 'a\"b' has a \" in its name, which a .msh file cannot hold");
  CHECK(mesh && access(in_work_folder("n.msh"), F_OK) != 0 && flesh_mesh_write(mesh, in_work_folder("n.mesh")) == FLESH_OK);
  flesh_mesh_destroy(&mesh);
}

/* In every derived mesh, the nodes of a set that represents a plane are those in the plane. */
static void check_plane(const flesh_mesh *mesh)
{
  const int k = flesh_mesh_sets_find(&mesh->sets, "plane", 5), all = flesh_mesh_sets_find(&mesh->sets, "some", 4);
  int next = 0;
  CHECK(k >= 0 && all >= 0);
  if (k < 0 || all < 0) return;
  const flesh_members *nodes = &mesh->sets.sets[k].nodes, *tets = &mesh->sets.sets[all].tets;
  for (int i = 0; i < mesh->nodes; i++)
    if (fabs(mesh->positions[3 * (size_t)i]) < 1e-9) CHECK(next < nodes->count && nodes->values[next++] == i);
  CHECK(next == nodes->count && next > 0);
  next = 0;
  for (int t = 0; t < mesh->tets; t++)
    if (mesh->regions[t] == 1) CHECK(next < tets->count && tets->values[next++] == t);
  CHECK(next == tets->count && next > 0);
}

static void sets_follow_their_mesh(void)
{
  flesh_mesh *box, *mesh, *raised, *refined, *finer, *lowered;
  int regions[48];
  flesh_mesh_sets sets = {0};
  CHECK_OK(flesh_mesh_box((int[]){2, 2, 2}, (double[]){2, 2, 2}, (double[]){0, 0, 0}, &box));
  int set;
  CHECK_OK(flesh_mesh_sets_take(&sets, "plane", 5, &set));
  for (int i = box->nodes - 1; i >= 0; i--)
    if (box->positions[3 * (size_t)i] == 0) CHECK_OK(flesh_members_add(&sets.sets[set].nodes, i));
  CHECK_OK(flesh_members_add(&sets.sets[set].nodes, 0));
  CHECK_OK(flesh_mesh_sets_take(&sets, "some", 4, &set));
  for (int t = 0; t < 48; t++) {
    regions[t] = t % 5 == 1;
    if (regions[t]) CHECK_OK(flesh_members_add(&sets.sets[set].tets, t));
  }
  flesh_mesh_sets_settle(&sets);
  CHECK_OK(flesh_mesh_build(&(flesh_mesh_lists){.nodes = box->nodes, .tets = box->tets, .positions = box->positions,
                                                .tet_nodes = box->tet_nodes, .regions = regions, .sets = &sets}, NULL, &mesh));
  flesh_mesh_sets_clear(&sets);
  check_plane(mesh);
  CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
  check_plane(raised);
  CHECK_OK(flesh_mesh_refine(mesh, &refined));
  check_plane(refined);
  CHECK_OK(flesh_mesh_refine(raised, &finer));
  check_plane(finer);
  CHECK_OK(flesh_mesh_lower_order(finer, &lowered));
  check_plane(lowered);
  for (int order = 1; order <= 2; order++) {
    flesh_mesh *halved, *of = order == 1 ? mesh : raised;
    uint8_t halvings[48] = {4, 0, 3, [20] = 1};
    CHECK_OK(flesh_mesh_refine_marked(of, halvings, &halved, NULL));
    CHECK(halved && halved->sets.sets[0].nodes.count > of->sets.sets[0].nodes.count + 2);
    check_plane(halved);
    flesh_mesh_destroy(&halved);
  }
  flesh_mesh_destroy(&box);
  flesh_mesh_destroy(&mesh);
  flesh_mesh_destroy(&raised);
  flesh_mesh_destroy(&refined);
  flesh_mesh_destroy(&finer);
  flesh_mesh_destroy(&lowered);
}

static void a_curved_tet_has_its_volume(void)
{
  /* The node on the edge of corners 1 and 2 is moved by d along x. The volume is linear in the x of all nodes, and its
   * derivative by this one is the integral of the node's shape function times n_x over the faces that have it: a third
   * of the projection of the slanted face, which is 1/2. So the volume is 1/6 + d/6. */
  flesh_mesh *mesh;
  for (int format = 0; format < 2; format++) {
    const char *points[2] = {"1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,.5,0,0\n6,.53,.5,0\n7,0,.5,0\n8,0,0,.5\n9,.5,0,.5\n10,0,.5,.5\n",
                             "0 0 0 1 0 0 0 1 0 0 0 1 .5 0 0 .53 .5 0 0 .5 0 0 0 .5 .5 0 .5 0 .5 .5"};
    char text[1024];
    if (format == 0)
      snprintf(text, sizeof text, "*NODE\n%s*ELEMENT, TYPE=C3D10M\n1,1,2,3,4,5,6,7,8,9,10\n", points[0]);
    else
      snprintf(text, sizeof text, "<VTKFile type=\"UnstructuredGrid\"><Piece NumberOfPoints=\"10\" NumberOfCells=\"1\"><Points>"
               "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">%s</DataArray></Points><Cells>"
               "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3 4 5 6 7 8 9</DataArray>"
               "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">10</DataArray>"
               "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">24</DataArray></Cells></Piece></VTKFile>", points[1]);
    CHECK_OK(flesh_mesh_read(write_text(format ? "c.vtu" : "c.inp", text), &mesh));
    if (!mesh) continue;
    CHECK_NEAR(mesh->volumes[0], 1. / 6 + 0.03 / 6, 1e-15);
    CHECK(mesh->positions[15] == 0.53 && mesh->edge_nodes[1] == 5 && mesh->curved[0]);
    flesh_mesh_destroy(&mesh);
  }
}

int main(int argc, char **argv)
{
  if (!make_work_folder()) return 1;
  return RUN_TESTS(argc, argv, TEST(decks_have_sets_and_regions), TEST(surfaces_are_sets_of_nodes),
                   TEST(vega_files_have_sets_and_regions), TEST(gmsh_groups_are_sets),
                   TEST(sets_follow_their_mesh), TEST(written_files_have_sets), TEST(a_curved_tet_has_its_volume));
}
