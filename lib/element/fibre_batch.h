/* fibre_batch.h: operations of fibre kernels on a batch of tets at a point. A fibre has the direction a at rest; with
 * w_n = grad N_n . a, the nodes' gradients along it, whose sum is 0,
 *
 *   f = F a = sum of w_n x_n,   force on n: volume T w_n f,   block of m and n: volume w_m w_n (T 1 + D f f^T). */
#ifndef FLESH_ELEMENT_FIBRE_BATCH_H
#define FLESH_ELEMENT_FIBRE_BATCH_H

#include "element/tet_lanes.h"
#include "material/fibre_forms.h"

/* Bound of f.f above which an energy could overflow. */
#define LARGEST_SQUARE 1e200

/* A batch at a point. */
typedef struct fibres {
  flesh_real weight[ELEMENT_NODES], volume;
  flesh_real f[3], square;
  flesh_fibre_real at;
} fibres;

/* Loads w_0 to w_3 of a four-node tet, and the volume, at point q. */
INLINE void load_weights(const flesh_batches *batches, int index, int q, flesh_real w[4], flesh_real *volume)
{
  const size_t place = (size_t)index * (size_t)batches->shapes_per_tet + (size_t)(batches->shapes_per_tet > 1 ? q : 0);
  const flesh_real_at *own = (const flesh_real_at *)(batches->fibres + 4 * FLESH_LANES * place);
  for (int a = 0; a < 3; a++) w[a + 1] = own[a];
  w[0] = -(w[1] + w[2] + w[3]);
  *volume = own[3];
}

INLINE void load_fibres(const flesh_batches *batches, int index, tets *t)
{
  *t = (tets){.material = batches->material[index],
              .node = batches->tiles.nodes + (size_t)index * ELEMENT_NODES * FLESH_LANES,
              .pair = batches->tiles.pairs + (size_t)index * ELEMENT_PAIRS * FLESH_LANES};
}

/* Computes the derivative along the fibre of a vector; d [1 to ELEMENT_NODES - 1] are its values minus that of the
 * first node. */
INLINE void along_fibre(const fibres *b, flesh_real (*d)[3], flesh_real f[3])
{
  for (int i = 0; i < 3; i++) {
    f[i] = flesh_all(0);
    for (int n = 1; n < ELEMENT_NODES; n++) f[i] += b->weight[n] * d[n][i];
  }
}

/* Computes f from the nodes' positions, and the energy with its derivatives. */
INLINE int find_tension(const flesh_tet_point *at, flesh_real (*d)[3], fibres *b)
{
  along_fibre(b, d, b->f);
  b->square = flesh_vec3_dot(b->f, b->f);
  if (flesh_any((b->square < LARGEST_SQUARE) == 0)) return FLESH_NONFINITE;
  flesh_fibre_form(at->fibre, at->activation, b->square, &b->at);
  return FLESH_OK;
}

/* Adds the dependence of tension on speed; reads x_0 and v_0 if `at` has a frozen state. The rate of f.f/2, like that
 * of the Green strain in viscous_batch.h, is f.f', and with a frozen state 1/2 (f + f_0).f' - 1/2 (f - f_0).f_0'. */
INLINE void add_speed(const flesh_tet_point *at, flesh_real (*v)[3], flesh_real (*x_0)[3], flesh_real (*v_0)[3],
                      fibres *b)
{
  flesh_real rate[3], start[3], e, square = b->square;
  along_fibre(b, v, rate);
  e = flesh_vec3_dot(b->f, rate);
  if (at->x_frozen) {
    along_fibre(b, x_0, start);
    square = flesh_vec3_dot(start, start);
    e = 0.5 * (e + flesh_vec3_dot(start, rate));
    if (at->v_frozen) {
      along_fibre(b, v_0, rate);
      e -= 0.5 * (flesh_vec3_dot(b->f, rate) - flesh_vec3_dot(start, rate));
    }
  }
  flesh_fibre_add_speed(at->fibre, at->activation, b->square, square, e, at->ratio, &b->at);
}

/* Computes T 1 + D f f^T times volume and scale: entries 00 01 02 11 12 22. */
INLINE void fibre_matrix(const flesh_tet_point *at, fibres *b, flesh_real H[6])
{
  if (at->filter) flesh_fibre_filter(at->filter, b->square, &b->at);
  const flesh_real scale = at->scale * b->volume, D = scale * b->at.D, T = scale * b->at.T;
  for (int i = 0, k = 0; i < 3; i++)
    for (int j = i; j < 3; j++, k++) H[k] = i == j ? D * b->f[i] * b->f[j] + T : D * b->f[i] * b->f[j];
}

static const unsigned char entry_of_six[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};

/* Adds the energy and its size. */
INLINE void add_energy(const fibres *b, flesh_real sums[2])
{
  sums[0] += b->volume * b->at.value;
  sums[1] += b->volume * (flesh_abs(b->at.value) + flesh_abs(b->at.T) * b->square);
}

#endif
