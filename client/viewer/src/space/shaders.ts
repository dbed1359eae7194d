// Shaders of surfaces and particles. Colours are sRGB; positions are relative to the frame's origin.

/** `tint`: the colour of the tint, or one colour for particles; `values`: the colour map. */
export const COLOUR_MODE = { tint: 0, values: 1 } as const;

/** Light on surfaces. `canvas_drawing.ts` and `facet.ts` have the same formulas. */
export const LIGHT = {
  /** Direction to the light along the axes right, up and to the camera. */
  direction: [-0.35, 0.55, 1],
  brightest: 1.06,
  /** Of the highlight: its strength, and the exponent of the cosine. */
  shine: 0.16,
  sharpness: 40,
  /** On the inside of a body, which a clip plane shows, as a share. */
  inside: 0.62,
  /** On a cut face. It does not depend on the direction, so that the face does not look like a shadow. */
  cutFace: 0.8,
} as const;
/** Share of the accent in the colour of a selected shell. */
export const ACCENT_SHARE = 0.62;

const float = (number: number) => number.toFixed(2);

const VALUE_COLOUR = `
uniform sampler2D ramp;
uniform vec2 range;
uniform vec3 missing;
vec3 colourOf(float value) {
  if (!(abs(value) < 3.0e38)) return missing;
  float share = range.y > range.x ? clamp((value - range.x) / (range.y - range.x), 0.0, 1.0) : 0.0;
  return texture2D(ramp, vec2(share * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
}`;

/** `place` lies in its triangle also where a silhouette covers a pixel in part. */
const CLIP = `
uniform vec4 clip;
centroid varying vec3 place;
float above() { return dot(place, clip.xyz) - clip.w; }
bool isCutAway() { return above() > 0.0; }`;

/** Alpha of a tint: drawing.ts, SELECTED. */
export const SURFACE_VERTEX = `
attribute vec4 tint;
attribute float value;
attribute float inCut;
varying vec4 tintHere;
varying float valueHere;
varying float inCutHere;
varying vec3 normalHere;
varying vec3 seen;
centroid varying vec3 place;
void main() {
  tintHere = tint;
  valueHere = value;
  inCutHere = inCut;
  place = position;
  normalHere = normalMatrix * normal;
  vec4 at = modelViewMatrix * vec4(position, 1.0);
  seen = at.xyz;
  gl_Position = projectionMatrix * at;
}`;

export const SURFACE_FRAGMENT = `
uniform int mode;
uniform bool isFlat;
uniform bool isParallel;
uniform bool hasCutFace;
uniform float deepest;
uniform float opacity;
uniform vec3 accent;
uniform float ambient;
varying vec4 tintHere;
varying float valueHere;
varying float inCutHere;
varying vec3 normalHere;
varying vec3 seen;
${CLIP}${VALUE_COLOUR}
void main() {
  // The share of the pixel that stays: the border of a cut is smooth.
  float height = above();
  float width = min(fwidth(height), deepest);
  float stays = width > 0.0 ? clamp(0.5 - height / width, 0.0, 1.0) : step(height, 0.0);
  if (stays == 0.0) discard;
#ifdef FLIP_SIDED
  bool isInside = gl_FrontFacing;
#else
  bool isInside = !gl_FrontFacing;
#endif
  // Behind the clip plane, the first surface is seen from its inside where the plane cuts a body.
  bool isCut = hasCutFace && isInside;
  // Walls and faces of the box are flat. A point on their rim has the normal of the free surface.
  bool isFlatHere = isFlat || inCutHere > 0.999;
  vec3 normal = isFlatHere ? normalize(cross(dFdx(seen), dFdy(seen))) : normalize(normalHere) * (isInside ? -1.0 : 1.0);
  // Points in the cut face have no number.
  vec3 base = mode == ${COLOUR_MODE.values} ? (isCut ? missing : colourOf(valueHere)) : tintHere.rgb;
  float ofShell = step(0.5, tintHere.a);
  float ofBody = step(0.16, tintHere.a - ofShell * 2.0 / 3.0);
  base = mix(base, accent, ${float(ACCENT_SHARE)} * (isCut ? ofBody : ofShell));
  if (isInside && !isCut) base *= ${float(LIGHT.inside)};
  vec3 light = normalize(vec3(${LIGHT.direction.map(float)}));
  vec3 eye = isParallel ? vec3(0.0, 0.0, 1.0) : normalize(-seen);
  // Falls off smoothly, so that shadows keep their shape.
  float wrapped = 0.5 * dot(normal, light) + 0.5;
  float diffuse = isCut ? ${float(LIGHT.cutFace)} : wrapped * wrapped;
  float shine = !isInside ? ${float(LIGHT.shine)} * pow(max(dot(normal, normalize(light + eye)), 0.0), ${float(LIGHT.sharpness)}) : 0.0;
  gl_FragColor = vec4(base * (ambient + (${float(LIGHT.brightest)} - ambient) * diffuse) + shine, opacity * stays);
}`;

export const POINT_VERTEX = `
attribute float value;
uniform float diameter;
uniform float smallest;
uniform float distance;
varying float valueHere;
centroid varying vec3 place;
void main() {
  valueHere = value;
  place = position;
  vec4 at = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * at;
  // \`distance\`: of the target in a perspective picture, else 0.
  gl_PointSize = max(diameter * (distance > 0.0 ? distance / -at.z : 1.0), smallest);
}`;

export const POINT_FRAGMENT = `
uniform int mode;
uniform vec3 colour;
varying float valueHere;
${CLIP}${VALUE_COLOUR}
void main() {
  vec2 from = gl_PointCoord - 0.5;
  float square = 4.0 * dot(from, from);
  if (isCutAway() || square > 1.0) discard;
  vec3 base = mode == ${COLOUR_MODE.values} ? colourOf(valueHere) : colour;
  gl_FragColor = vec4(base * (1.0 - 0.35 * square), 1.0);
}`;

export const EDGE_VERTEX = `
centroid varying vec3 place;
void main() {
  place = position;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

export const EDGE_FRAGMENT = `
uniform vec3 colour;
uniform float opacity;
${CLIP}
void main() {
  if (isCutAway()) discard;
  gl_FragColor = vec4(colour, opacity);
}`;

export const CUT_FACE_VERTEX = `
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

/** The colour does not matter: the cut face writes its depth only. */
export const CUT_FACE_FRAGMENT = `
void main() {
  gl_FragColor = vec4(0.0);
}`;
