"""Rows of a block of samples: one flat float32 array, so that the compiler can assume that rows do not overlap.

Lengths are in the stage's unit. All normals are unit vectors on the viewer's side.
"""

from __future__ import annotations

BLOCK = 128

# The sample's place: position, unit direction to the viewer, geometric normal, a pixel's size at that distance.
PX, PY, PZ, VX, VY, VZ, GX, GY, GZ, PIXEL = range(0, 10 * BLOCK, BLOCK)
# The sample's material: shading normal, clear coat's normal, base colour (linear) and alpha.
NX, NY, NZ, CX, CY, CZ, RED, GREEN, BLUE, ALPHA = range(10 * BLOCK, 20 * BLOCK, BLOCK)
# Perceptual roughness, metallic, reflectance at normal incidence of its dielectric part, clear coat, transmission, emission,
# flags (0 or 1), share of light that its occlusion texture leaves.
ROUGH, METAL, F0R, F0G, F0B, COAT, COAT_ROUGH, TRANSMISSION = range(20 * BLOCK, 28 * BLOCK, BLOCK)
ER, EG, EB, UNLIT, GROUND, CATCHER, BLENDED, AO = range(28 * BLOCK, 36 * BLOCK, BLOCK)
# Interpolated: both uv sets; barycentrics of the second and third corner.
U0, V0, U1, V1, BARY1, BARY2 = range(36 * BLOCK, 42 * BLOCK, BLOCK)
# Light around: visible share of the ambient light from above, and of the ground's light; then scratch.
OPEN, BOUNCE, OPENX, OPENY, OPENZ = range(42 * BLOCK, 47 * BLOCK, BLOCK)
# Before that, for textured triangles: edges from the first corner to the second and the third, how both uv sets change along
# these edges; -1 if the back of the file's normals is visible.
AX, AY, AZ, UA0, VA0, UA1, VA1, BX, BY, BZ, UB0, VB0, UB1, VB1, SIDE = range(42 * BLOCK, 57 * BLOCK, BLOCK)
# One light: unit direction to the light, irradiance on a plane that faces it, share its shadows leave, its angular radius.
LX, LY, LZ, IR, IG, IB, SHARE, WIDTH = range(47 * BLOCK, 55 * BLOCK, BLOCK)
# Radiance towards the viewer: diffuse, specular (coat included); share of the background's ground that fades into the sky.
DR, DG, DB, SR, SG, SB, FADE = range(55 * BLOCK, 62 * BLOCK, BLOCK)
# Scratch, free between stages.
T0, T1, T2, T3, T4, T5, T6, T7 = range(62 * BLOCK, 70 * BLOCK, BLOCK)
# The response of a surface to light (`kernels_light.weigh`): it mirrors a light by FACE + EDGE times Schlick's power; LOBE and
# RIM integrate the lobe and the lobe times that power; BASE is its diffuse reflectance, TAKEN the share that the coat reflects,
# THROUGH the share that a transmissive surface lets through, before its tint.
FACE_R, FACE_G, FACE_B, EDGE_R, EDGE_G, EDGE_B, BASE_R, BASE_G, BASE_B = range(70 * BLOCK, 79 * BLOCK, BLOCK)
LOBE, RIM, TAKEN, THROUGH = range(79 * BLOCK, 83 * BLOCK, BLOCK)
# 1 on scenery, else 0.
SCENERY = 83 * BLOCK
# Position and shading normal in the axes in which sky occlusion was baked.
OX, OY, OZ, ONX, ONY, ONZ = range(84 * BLOCK, 90 * BLOCK, BLOCK)
# Light that things reflect onto the sample: radiance of a white matt surface, and of one leaning towards the mirrored ray; the
# share of the sky's own light that it replaces, as far as probes know it, and 1 where it is all light, since a lightmap has it;
# then what the nearest probes see, and from KEPT on their weights and place, see `kernels_bounce`. The last row is room for
# vectors that begin in the row before.
GLOW_R, GLOW_G, GLOW_B, LEAN_R, LEAN_G, LEAN_B, INSIDE, MAPPED, PROBES = range(90 * BLOCK, 99 * BLOCK, BLOCK)
KEPT = PROBES + 28 * BLOCK
# The light that solid glass bends towards the viewer (`kernels_bend`): its direction, then its radiance; what further surfaces
# leave of it; how far it takes the place of the light from straight behind.
BENT_X, BENT_Y, BENT_Z, STAIN_R, STAIN_G, STAIN_B, BENT = range((98 + 28 + 10) * BLOCK, (98 + 28 + 17) * BLOCK, BLOCK)
ROWS = 98 + 28 + 17
