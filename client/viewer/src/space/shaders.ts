// Shaders of surfaces and particles. Colours are sRGB; positions are relative to the frame's origin.

/** `plain`: the colour of the tint; `values`: of the colour map. */
export const COLOUR_MODE = { tint: 0, values: 1 } as const;

const VALUE_COLOUR = `
uniform sampler2D ramp;
uniform vec2 range;
uniform vec3 missing;
vec3 colourOf(float value) {
  if (!(abs(value) < 3.0e38)) return missing;
  float share = range.y > range.x ? clamp((value - range.x) / (range.y - range.x), 0.0, 1.0) : 0.0;
  return texture2D(ramp, vec2(share * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb;
}`;

const CLIP = `
uniform vec4 clip;
varying vec3 place;
bool isCut() { return dot(place, clip.xyz) > clip.w; }`;

/** Alpha of a tint: 1 for selected shells. */
export const SURFACE_VERTEX = `
attribute vec4 tint;
attribute float value;
varying vec4 tintHere;
varying float valueHere;
varying vec3 normalHere;
varying vec3 seen;
varying vec3 place;
void main() {
  tintHere = tint;
  valueHere = value;
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
uniform float opacity;
uniform vec3 accent;
uniform float ambient;
varying vec4 tintHere;
varying float valueHere;
varying vec3 normalHere;
varying vec3 seen;
${CLIP}${VALUE_COLOUR}
void main() {
  if (isCut()) discard;
  vec3 normal = isFlat ? normalize(cross(dFdx(seen), dFdy(seen)))
                       : normalize(normalHere) * (gl_FrontFacing ? 1.0 : -1.0);
  vec3 base = mode == ${COLOUR_MODE.values} ? colourOf(valueHere) : tintHere.rgb;
  base = mix(base, accent, 0.62 * tintHere.a);
  // The inside of a body, which a clip plane shows.
  if (!gl_FrontFacing) base *= 0.62;
  vec3 light = normalize(vec3(-0.35, 0.55, 1.0));
  vec3 eye = isParallel ? vec3(0.0, 0.0, 1.0) : normalize(-seen);
  // Falls off smoothly, so that shadows keep their shape.
  float wrapped = 0.5 * dot(normal, light) + 0.5;
  float diffuse = wrapped * wrapped;
  float shine = gl_FrontFacing ? 0.16 * pow(max(dot(normal, normalize(light + eye)), 0.0), 40.0) : 0.0;
  gl_FragColor = vec4(base * (ambient + (1.06 - ambient) * diffuse) + shine, opacity);
}`;

export const POINT_VERTEX = `
attribute float value;
uniform float diameter;
uniform float smallest;
uniform float distance;
varying float valueHere;
varying vec3 place;
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
  if (isCut() || square > 1.0) discard;
  vec3 base = mode == ${COLOUR_MODE.values} ? colourOf(valueHere) : colour;
  gl_FragColor = vec4(base * (1.0 - 0.35 * square), 1.0);
}`;

export const EDGE_VERTEX = `
varying vec3 place;
void main() {
  place = position;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

export const EDGE_FRAGMENT = `
uniform vec3 colour;
uniform float opacity;
${CLIP}
void main() {
  if (isCut()) discard;
  gl_FragColor = vec4(colour, opacity);
}`;
