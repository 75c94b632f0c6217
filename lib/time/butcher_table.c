/* butcher_table.c: coefficients from the papers, which test_runge_kutta compares with those of ARKODE and with the
 * conditions of order.
 *
 * Bank, Coughran, Fichtner, Grosse, Rose, Smith: Transient simulation of silicon devices and circuits, IEEE Transactions
 * on Electron Devices 32, 1985; with the embedded method of Hosea, Shampine: Analysis and implementation of TR-BDF2,
 * Applied Numerical Mathematics 20, 1996.
 * Kennedy, Carpenter: Diagonally implicit Runge-Kutta methods for ordinary differential equations, a review,
 * NASA/TM-2016-219173, 2016: ESDIRK3(2)4L[2]SA in section 5.4.1 and ESDIRK3(2)5L[2]SA in section 6.2. */
#include "time/butcher_table.h"

#include <stddef.h>

#define NAME(NAME, name, doc) name,
const char *const flesh_table_names[] = {FLESH_TABLE_LIST(NAME) NULL};
#undef NAME

#define GAMMA_325 0.225
#define GAMMA_324 0.435866521508458999416019451193556843
#define GAMMA_TR 0.292893218813452475599155637895150961 /* 1 - sqrt(1/2) */
#define W_TR 0.353553390593273762200422181052424520     /* sqrt(2)/4 */

static const flesh_butcher_table tables[] = {
    [FLESH_TABLE_ESDIRK325] =
        {.stages = 5,
         .order = 3,
         .c = {0, 0.45, 0.768198051533946385798225005, 0.6, 1},
         .a = {{0},
               {GAMMA_325, GAMMA_325},
               {0.271599025766973192899112503, 0.271599025766973192899112503, GAMMA_325},
               {0.223743686707645845166, 0.223743686707645845166, -0.0724873734152916284, GAMMA_325},
               {0.17554550212940523, 0.17554550212940523, -0.34685820002600626, 0.77076719576719577, GAMMA_325}},
         .embedded = {0.18435122201605925, 0.18435122201605925, -0.27820818405098702, 0.69686201254332369,
                      0.21264372747554489}},
    [FLESH_TABLE_ESDIRK324] =
        {.stages = 4,
         .order = 3,
         .c = {0, 2 * GAMMA_324, 0.6, 1},
         .a = {{0},
               {GAMMA_324, GAMMA_324},
               {0.25764824606642722, -0.093514767574886248, GAMMA_324},
               {0.18764102434672381, -0.59529747357695484, 0.9717899277217722, GAMMA_324}},
         .embedded = {0.10889661761586122, -0.91532581187071183, 1.2712735973021543, 0.53515559695269621}},
    [FLESH_TABLE_TRBDF2] =
        {.stages = 3,
         .order = 2,
         .c = {0, 2 * GAMMA_TR, 1},
         .a = {{0}, {GAMMA_TR, GAMMA_TR}, {W_TR, W_TR, GAMMA_TR}},
         .embedded = {(1 - W_TR) / 3, (1 + 3 * W_TR) / 3, GAMMA_TR / 3}}};

const flesh_butcher_table flesh_butcher_backward_euler = {
    .stages = 2, .order = 1, .c = {0, 1}, .a = {{0}, {0, 1}}, .embedded = {0.5, 0.5}};

const flesh_butcher_table *flesh_butcher_table_of(flesh_table table) { return &tables[table]; }
