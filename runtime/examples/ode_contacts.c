// SPDX-License-Identifier: Apache-2.0
/* ode_contacts.c - another simulator's penalty contacts: a plate of 0.1 kg falls onto triangles in
 * the Open Dynamics Engine. Each contact with the full stiffness throws it; weighed, it stays. */
#include <hapsix/hapsix.h>
#include <math.h>
#include <ode/ode.h>
#include <stdio.h>
enum { N = 24, MOST = 2048 };

static double simulate(h6Method method, size_t* most) {
  static const int dx[6] = {0, 1, 0, 1, 1, 0}, dy[6] = {0, 0, 1, 0, 1, 1};
  static float corner[6 * N * N][3];
  static dTriIndex index[6 * N * N];
  for (int i = 0; i < 6 * N * N; ++i) {
    corner[i][0] = 0.01f * (float)(i / 6 % N + dx[i % 6] - N / 2);
    corner[i][1] = 0.01f * (float)(i / 6 / N + dy[i % 6] - N / 2), index[i] = (dTriIndex)i;
  }
  dTriMeshDataID data = dGeomTriMeshDataCreate();
  dGeomTriMeshDataBuildSingle(data, corner, 12, 6 * N * N, index, 6 * N * N, 3 * sizeof *index);
  dGeomID floor = dCreateTriMesh(NULL, data, NULL, NULL, NULL);
  dGeomID plate = dCreateBox(NULL, 0.1, 0.1, 0.01);
  dWorldID world = dWorldCreate();
  dBodyID body = dBodyCreate(world);
  dMass mass;
  dWorldSetGravity(world, 0, 0, -9.81), dMassSetBoxTotal(&mass, 0.1, 0.1, 0.1, 0.01);
  dBodySetMass(body, &mass), dGeomSetBody(plate, body), dBodySetPosition(body, 0.003, 0.002, 0.01);
  h6ContactDef contact = h6DefaultContactDef();
  contact.method = method;
  double highest = 0;
  for (int step = 0; step < 2000; ++step) {
    static dContactGeom found[MOST];
    static float normals[MOST][3], arms[MOST][3], depths[MOST];
    const int count = dCollide(plate, floor, MOST, found, sizeof *found);
    const dReal *p = dBodyGetPosition(body), *v = dBodyGetLinearVel(body);
    const dReal* w = dBodyGetAngularVel(body);
    for (int i = 0; i < count; depths[i] = (float)found[i].depth, ++i)
      for (int k = 0; k < 3; ++k)
        normals[i][k] = (float)found[i].normal[k], arms[i][k] = (float)(found[i].pos[k] - p[k]);
    const h6Velocity velocity = {{v[0], v[1], v[2]}, {w[0], w[1], w[2]}};
    h6ContactArrays all = h6DefaultContactArrays();
    all.count = (size_t)count, all.normals = *normals, all.arms = *arms, all.depths = depths;
    all.velocity = &velocity;
    h6Wrench f;
    if (h6WeighContacts(&contact, &all, 1e-3, 0.1, NULL, &f, NULL, NULL, NULL) != 0) return -1;
    dBodyAddForce(body, f.force.x, f.force.y, f.force.z);
    dBodyAddTorque(body, f.torque.x, f.torque.y, f.torque.z);
    dWorldStep(world, 1e-3);
    if (all.count > *most) *most = all.count;
    highest = fmax(highest, dBodyGetPosition(body)[2]);
  }
  return dGeomDestroy(floor), dGeomDestroy(plate), dWorldDestroy(world), highest;
}

int main(void) {
  dInitODE2(0);
  size_t most = 0;
  const double thrown = simulate(H6_METHOD_NONE, &most), held = simulate(H6_METHOD_FIRM, &most);
  printf("%zu contacts, highest %.3f m without weights, %.3f m with\n", most, thrown, held);
  return dCloseODE(), 0;
}
