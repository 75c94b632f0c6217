/* E's, and c2 (I_C-3)^2 (Yeoh 1993). */
static inline void flesh_psi_yeoh(const flesh_material *m, int with_value, flesh_real I_C,
                                  flesh_real J, flesh_psi_real *psi)
{
  flesh_real stretch = I_C - 3;
  flesh_psi_e(m, with_value, I_C, J, psi);
  if (with_value) psi->value += m->c2 * stretch * stretch;
  psi->I += 2 * m->c2 * stretch;
  psi->II = flesh_all(2 * m->c2);
}

