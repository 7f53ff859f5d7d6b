/* The practical limit of Embree on one thread: coherent packets of 16 rays,
 * from a pose to ranges and ids, without any Python. Types and the order of
 * fields are those of Embree 4's RTCRayHit16. */

#include <math.h>
#include <stdint.h>
#include <string.h>

#define LANES 16

typedef struct {
  float org_x[LANES], org_y[LANES], org_z[LANES], tnear[LANES];
  float dir_x[LANES], dir_y[LANES], dir_z[LANES], time[LANES], tfar[LANES];
  uint32_t mask[LANES], id[LANES], flags[LANES];
  float Ng_x[LANES], Ng_y[LANES], Ng_z[LANES], u[LANES], v[LANES];
  uint32_t primID[LANES], geomID[LANES], instID[LANES], instPrimID[LANES];
} __attribute__((aligned(64))) RayHit16;

typedef void (*Intersect16)(const int *valid, void *scene, RayHit16 *rays,
                            void *arguments);

/* d_S: directions in the sensor frame, three rows of n; n a multiple of 16. */
void cast_limit(Intersect16 intersect, void *scene, void *arguments,
                const float *R_WS, const float *p_WS, const float *d_S,
                int64_t n, float max_range, float *ranges, uint32_t *prim,
                uint32_t *geom) {
  int valid[LANES] __attribute__((aligned(64)));
  for (int k = 0; k < LANES; ++k) valid[k] = -1;
  const float *dx = d_S, *dy = d_S + n, *dz = d_S + 2 * n;
  for (int64_t begin = 0; begin < n; begin += LANES) {
    RayHit16 r;
    memset(&r, 0, sizeof r);
    for (int k = 0; k < LANES; ++k) {
      const float x = dx[begin + k], y = dy[begin + k], z = dz[begin + k];
      r.dir_x[k] = R_WS[0] * x + R_WS[1] * y + R_WS[2] * z;
      r.dir_y[k] = R_WS[3] * x + R_WS[4] * y + R_WS[5] * z;
      r.dir_z[k] = R_WS[6] * x + R_WS[7] * y + R_WS[8] * z;
      r.org_x[k] = p_WS[0];
      r.org_y[k] = p_WS[1];
      r.org_z[k] = p_WS[2];
      r.tfar[k] = max_range;
      r.mask[k] = r.geomID[k] = r.instID[k] = 0xFFFFFFFFu;
    }
    intersect(valid, scene, &r, arguments);
    for (int k = 0; k < LANES; ++k) {
      ranges[begin + k] = r.geomID[k] == 0xFFFFFFFFu ? INFINITY : r.tfar[k];
      prim[begin + k] = r.primID[k];
      geom[begin + k] = r.geomID[k];
    }
  }
}
