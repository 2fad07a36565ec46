// Voxels are drawn as points: squares while the view moves, blocks (a ray meets a cube in each pixel) once it rests.

const COLOURS = ["picture", "thing", "room", "height", "heat"];
const FAINT = 0.02; // heat, as a share of the hottest, from which a voxel has a colour of heat
const GLOWING = 0.4; // and from which it has no other

const VOXEL_VERTEX = `#version 300 es
layout(location = 0) in vec3 cell;
layout(location = 1) in vec3 rgb;
layout(location = 2) in vec4 label;
layout(location = 3) in float heat;
uniform mat4 levelFromCells, clipFromLevel;
uniform float edge, block, pixels, cellM, mode, hottest;
uniform vec2 cut, heights;
uniform sampler2D palette;
flat out vec3 colour, middle;

vec3 listed(float row, float at) { return texelFetch(palette, ivec2(int(at + 0.5), int(row)), 0).rgb; }

void main() {
  middle = block > 1.0 ? (floor(cell / block) + 0.5) * block : cell + 0.5;
  vec4 level = levelFromCells * vec4(middle, 1.0);
  gl_Position = clipFromLevel * level;
  gl_PointSize = clamp(pixels * cellM * edge / gl_Position.w, 1.5, 1024.0);
  if (level.z < cut.x || level.z > cut.y) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  float light = dot(rgb, vec3(0.3, 0.59, 0.11));
  if (mode < 0.5) colour = rgb;
  else if (mode < 1.5) colour = listed(0.0, label.x) * (label.x > 0.5 ? 0.55 + 0.6 * light : 0.45 + 0.8 * light);
  else if (mode < 2.5) colour = listed(1.0, label.y) * (0.6 + 0.5 * light);
  else if (mode < 3.5) colour = listed(2.0, 255.0 * clamp((level.z - heights.x) / (heights.y - heights.x), 0.0, 1.0));
  else {
    float warm = clamp(heat / max(hottest, 0.004), 0.0, 1.0);
    vec3 cold = vec3(0.42 + 0.42 * light);
    colour = mix(cold, listed(3.0, 255.0 * warm), smoothstep(${FAINT.toFixed(2)}, ${GLOWING.toFixed(2)}, warm));
  }
  colour = min(colour, vec3(1.0));
}`;

const SQUARE_FRAGMENT = `#version 300 es
precision mediump float;
flat in vec3 colour, middle;
out vec4 shown;
void main() { shown = vec4(colour, 1.0); }`;

const BLOCK_FRAGMENT = `#version 300 es
precision highp float;
flat in vec3 colour, middle;
uniform float edge, near, far, flatness;
uniform vec3 eye;
uniform mat3 ray;
uniform vec4 viewport;
out vec4 shown;
void main() {
  vec2 at = (gl_FragCoord.xy - viewport.xy) / viewport.zw * 2.0 - 1.0;
  vec3 along = ray * vec3(at * (1.0 - flatness), 1.0), from = eye + ray * vec3(at * flatness, 0.0);
  vec3 slope = 1.0 / along, start = slope * (from - middle), width = abs(slope) * edge * 0.5;
  vec3 enter = -start - width, leave = -start + width;
  float first = max(max(enter.x, enter.y), enter.z), last = min(min(leave.x, leave.y), leave.z);
  if (first > last || first < near) discard;
  float shade = first == enter.z ? 1.0 : first == enter.x ? 0.80 : 0.89;
  shown = vec4(colour * shade, 1.0);
  float inDepth = ((far + near) - 2.0 * far * near / first) / (far - near);
  gl_FragDepth = flatness > 0.5 ? (first - near) / (far - near) : 0.5 + 0.5 * inDepth;
}`;

const LINE_VERTEX = `#version 300 es
layout(location = 0) in vec3 place;
uniform mat4 clipFromLevel;
void main() { gl_Position = clipFromLevel * vec4(place, 1.0); }`;

const LINE_FRAGMENT = `#version 300 es
precision mediump float;
uniform vec4 tint;
out vec4 shown;
void main() { shown = tint; }`;
