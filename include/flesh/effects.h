/* effects.h: the effects that come with the library. Functions that return no status cannot fail. */
#ifndef FLESH_EFFECTS_H
#define FLESH_EFFECTS_H

#include "flesh/derivative_check.h"
#include "flesh/fibre.h"
#include "flesh/motion.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Each constructor returns a new effect that borrows `body`'s arrays and copies the rest. */

/* Nodes of a mesh, by their numbers: nodes [count]. */
typedef struct flesh_nodes {
  int count;
  const int *nodes;
} flesh_nodes;

/* Triangles of flesh_mesh_surface, by the numbers of their corners: corners [3*count]. */
typedef struct flesh_triangles {
  int count;
  const int *corners;
} flesh_triangles;

/* A point, m at rest, and the nodes that carry it along, as a joint's point is carried. */
typedef struct flesh_carried_point {
  flesh_nodes nodes;
  double point[3];
} flesh_carried_point;

/* Inertia: r = M a, with the kinetic energy v.Mv/2; the mass is lumped or consistent by body->mass. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_inertia(const flesh_body *body, flesh_effect **effect);

/* Elasticity: r = dV/dx, V = sum over tets of volume * psi(F), with F at one point of linear tets, at four of
 * quadratic ones (flesh_element). Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_elasticity(const flesh_body *body, flesh_effect **effect);

/* Gravity: r = -load M g for the acceleration g [3], m/s^2, by body->mass. Each linear tet gives rho V/4 g to its
 * nodes. A quadratic tet gives with the lumped mass the weight of each node, so that a free fall is rigid, and with
 * the consistent mass the exact load, -rho V/20 g to corners and rho V/5 g to nodes on edges; use the consistent mass
 * in statics. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_gravity(const flesh_body *body, const double acceleration[3],
                                   flesh_effect **effect);

/* A spring from the body's point nearest to `point` (rest coordinates, m; found within a tet, or the nearest surface
 * point) to the moving target: V = load k/2 |p(x) - target(t)|^2, stiffness k [N/m], while from <= t < until. The
 * displacement under a force at a point grows without limit as the mesh is refined (Kelvin 1848). Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_spring(const flesh_body *body, const double point[3], double stiffness,
                                const flesh_motion *target, double from, double until,
                                flesh_effect **effect);

/* Maximum number of nodes within the radius of a spring. All pairs of them are coupled, at some 75 bytes of the
 * matrix and its solver for each pair. */
enum { FLESH_SPRING_NODES = 1200 };

/* A spring on the part of the body within `radius`, m, of that point that is connected with it within the radius: V =
 * load k/2 |p(x) - target(t)|^2, p(x) = sum of w_a x_a. The weights carry the point: sum of w_a = 1 and sum of w_a
 * X_a is the point, so that every affine motion moves p(x) with the body. They are w_a = s_a (1 + g.(X_a - c)), with
 * the node's share s_a >= 0 of the rest volume under (1 - s^2)^2, s = |X - point|/radius, and the mean c of the
 * shares; behind a point of the surface some are negative. The force acts at p, without a torque about p: the angular
 * momentum about a fixed target is conserved. The displacement under the force converges under refinement. `radius`
 * 0: the spring acts on the point alone, as above; NaN: a twentieth of the longest side of the bounding box of the
 * body (of several bodies, that which has the point), or less if that contains more than FLESH_SPRING_NODES nodes.
 * FLESH_ERR_ARGUMENT also for a given radius that contains more. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_spring_within(const flesh_body *body, const double point[3], double radius,
                                         double stiffness, const flesh_motion *target, double from,
                                         double until, flesh_effect **effect);

/* The stiffness matrix used in damping: that of the rest shape, or that of the lagged state. */
typedef enum flesh_stiffness { FLESH_STIFFNESS_REST, FLESH_STIFFNESS_CURRENT } flesh_stiffness;

/* Rayleigh damping r = mass M v + stiffness K v, with coefficients [1/s, s] that are not negative and not both 0. K
 * is elasticity's Hessian without its negative eigenvalues, with lambda at most 9 mu. `mass` also damps rigid motion,
 * and K of the rest shape damps rotation once the body has rotated. Errors: FLESH_NONFINITE, FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_damping(const flesh_body *body, double mass, double stiffness,
                                   flesh_stiffness against, flesh_effect **effect);

/* Artificial damping that brings a motion to rest: r = rate w M v [1/s]. w rises from 0 to 1 as the lagged root mean
 * square speed rises from speed/2 to speed [m/s]; speed 0: w = 1. It acts while from <= t < until. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_settling_damping(const flesh_body *body, double rate, double speed,
                                            double from, double until, flesh_effect **effect);

/* Kelvin-Voigt damping by the rate E' of the Green strain: the second Piola-Kirchhoff stress is 2 shear dev E' + bulk
 * tr(E') I, viscosities in Pa s, not negative, not both 0. It has no torque, its power is never negative, and r = 0
 * where x = R X and v = w x (x). E' is computed from the point's frozen state: it is (E_{n+1} - E_n)/h over a step of
 * backward Euler or of the midpoint rule. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_viscosity(const flesh_body *body, double shear, double bulk,
                                     flesh_effect **effect);

/* The amplitude of a load: a factor that is interpolated between `points` [count], linearly or with cubic easing, and
 * constant before the first and after the last (1 without points). It applies while from <= t < until; outside, the
 * factor is 0. If a constructor's amplitude is NULL, the factor is 1 at all times. */
typedef struct flesh_curve_point {
  double t, value; /* s, ascending */
} flesh_curve_point;

typedef struct flesh_amplitude {
  int count;
  const flesh_curve_point *points;
  int smooth;
  double from, until; /* s; may be infinite */
} flesh_amplitude;

/* A dead load: a total force of `force` [3], N, shared evenly by `nodes` [count]; V = -force.displacement. Errors:
 * FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_force(const flesh_body *body, int count, const int *nodes,
                                 const double force[3], const flesh_amplitude *amplitude,
                                 flesh_effect **effect);

/* A dead load of `traction` [3], Pa per area of the rest shape, on `triangles` [3*count]. At order 2 the triangles
 * are some of flesh_mesh_surface, and the load is exact for the displacements of each triangle (of a whole face, each
 * node on an edge gets the load of a third of the area), also on curved faces. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_traction(const flesh_body *body, int count, const int *triangles,
                                    const double traction[3], const flesh_amplitude *amplitude,
                                    flesh_effect **effect);

/* A pressure, Pa, on the deformed `triangles` [3*count], wound outwards (flesh_mesh_surface): -p times the area
 * normal, a third to each node; at order 2 the exact integral of each node's shape function over the curved face,
 * which is divided into four triangles. On a closed surface V = p (volume - rest volume); on an open one the edges of
 * the rim are lagged and there is no energy. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_pressure(const flesh_body *body, int count, const int *triangles,
                                    double pressure, const flesh_amplitude *amplitude,
                                    flesh_effect **effect);

/* Muscle fibres in the tets `tets` [count], ascending (NULL: in all tets; count is their number), along `fibres`
 * [3*count], one direction of any length for each tet; (0, 0, 0): no fibres in this tet. V = sum of volume * W(|F
 * a|), W of flesh_fibre, at four points of quadratic tets. Fibres pull along their direction only; resistance to
 * compression and shear is the material's part. `activation` is the active fraction, with points from 0 to 1 (NULL:
 * 1), and is scaled by a point's load; outside from <= t < until it is 0 and the passive part remains. The change of
 * V at a fixed shape is external work. The role is LOAD. The eigenvalues of the Hessian in closed form: Kim, de Goes
 * & Iben 2019. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_muscle(const flesh_body *body, int count, const int *tets, const double *fibres,
                                  const flesh_fibre *fibre, const flesh_amplitude *activation, flesh_effect **effect);

/* Drag of a fluid of `density`, kg/m^3, with velocity `velocity` [3], m/s. Each part of `triangles` [3*count], wound
 * outwards, that moves against the stream with the normal speed s > 0 has the pressure coefficient * density/2 * s^2;
 * parts on the lee side have none. The surface is that of the lagged state. At order 2 the triangles are some of
 * flesh_mesh_surface, and the integrals over the curved faces use a rule of degree 6. Errors: FLESH_ERR_ARGUMENT,
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_drag(const flesh_body *body, int count, const int *triangles,
                                double density, const double velocity[3], double coefficient,
                                flesh_effect **effect);

/* Buoyancy: the pressure of a fluid at rest, density |acceleration| d, on the part of the whole surface where the
 * depth d below `level` is positive; heights are measured from the origin against `acceleration` [3], m/s^2. V = the
 * weight of the displaced fluid times its mean depth, with exact derivatives. All integrals are exact on flat faces,
 * and on curved faces that are wholly under water. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_buoyancy(const flesh_body *body, double level, double density,
                                    const double acceleration[3], flesh_effect **effect);

/* A weld ties the surfaces `first` and `second`, triangles of flesh_mesh_surface, where they face each other at rest
 * within `distance`, m, apart or overlapping; the meshes need not match. V = stiffness/2 times the integral over the
 * first surface of |x_1 - x_2|^2, where x_2 moves with the second surface's tet: affine motions have no energy, momentum
 * and angular momentum are conserved. The integral is over the overlaps of the triangles, so that constant stress passes
 * without error; the surfaces separate by traction/stiffness. `stiffness`, Pa/m; NaN: 30 times the lesser of 3 mu / edge
 * of the two sides.
 *
 * `breaks_at`, Pa: the overlap of two triangles breaks after a step or equilibrium at whose end sqrt(<t_n>^2 + t_s^2)
 * is above it, t_n and t_s being the normal and the tangential part of the overlap's mean traction per area at rest,
 * and <t_n> being 0 in compression. NaN: nothing breaks. The internal variables (flesh_system_internal_count) are one
 * for each overlap, 1 once it is broken, then the released energy, J, and the time, s, and place at rest, m, of the
 * first break; columns of histories are broken (fraction of the area), released (J) and traction (the largest value,
 * Pa, of that criterion over unbroken overlaps). Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_weld(const flesh_body *body, flesh_triangles first, flesh_triangles second,
                                double distance, double stiffness, double breaks_at,
                                flesh_effect **effect);

/* Maximum number of nodes in the two groups of a joint together; all pairs of them are coupled. */
enum { FLESH_JOINT_NODES = 2000 };

/* A joint holds together the points that the nodes `first` and `second` carry, both at `point` [3], m, at rest: V =
 * stiffness/2 |p_1 - p_2|^2, p_k = sum of w_a x_a with weights such that affine motions of the group carry p_k along
 * exactly. `axis` NULL: a ball joint. Otherwise a hinge along `axis` [3], m, with half of the stiffness, N/m, at each
 * of point - axis/2 and point + axis/2. Momentum and angular momentum are conserved. FLESH_ERR_ARGUMENT also if a
 * group does not span space and the point is not in the subspace that it spans. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_joint(const flesh_body *body, flesh_nodes first, flesh_nodes second,
                                 const double point[3], const double axis[3], double stiffness,
                                 flesh_effect **effect);

/* A spring between two points that groups of nodes carry: V = stiffness/2 (|p_1 - p_2| - length)^2, stiffness in N/m,
 * length in m; NAN: the distance at rest; 0: the points are drawn together. Momentum and angular momentum are
 * conserved. If the points meet, a spring with a length has no direction and no force. FLESH_ERR_ARGUMENT also for a
 * length if the points coincide at rest, and for points that their groups cannot carry. Further errors:
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_effect_joint_spring(const flesh_body *body, const flesh_carried_point *first,
                                        const flesh_carried_point *second, double stiffness,
                                        double length, flesh_effect **effect);

#ifdef __cplusplus
}
#endif
#endif
