// The program of the graphics card that draws the volume in space.

/** Values at which another material begins, at most. */
export const mostEnds = 48;

export const vertexCode = `#version 300 es
in vec2 corner;
out vec2 place;
void main() { place = corner; gl_Position = vec4(corner, 0.0, 1.0); }`;

// Rays in the box from 0 to 1, whose edges have the lengths \`size\`.
export const fragmentCode = `#version 300 es
precision highp float;
precision highp sampler3D;
in vec2 place;
out vec4 color;
uniform sampler3D samples;
uniform mat3 turn;
uniform vec3 size, texels;
uniform vec2 span, grey;
uniform float level, stretch;
uniform bool isSurface;
// The part of the box that is drawn; the colors of values from the black to the white of the window; how opaque a surface
// is, and how much a fog hides; the color of the surface.
uniform vec3 cropLow, cropHigh;
uniform sampler2D map;
uniform float opacity, density;
uniform vec3 tint;
// Values at which another class of values begins, and the color of each class; transparent: it is not drawn. Without
// such values, there are no materials.
uniform int endCount;
uniform float ends[${mostEnds}];
uniform vec4 tints[${mostEnds + 1}];

float at(vec3 p) { return texture(samples, p).r; }

float greyAt(vec3 p) { return clamp((at(p) - grey.x) / (grey.y - grey.x), 0.0, 1.0); }

// From the middle of the first color to that of the last one.
vec3 colorOf(float g) { return texture(map, vec2((g * 255.0 + 0.5) / 256.0, 0.5)).rgb; }

int classAt(vec3 p) {
  float value = at(p);
  int found = 0;
  while (found < endCount && value >= ends[found]) ++found;
  return found;
}

vec3 slope(vec3 p) {
  vec3 d = 1.0 / texels;
  return vec3(at(p + vec3(d.x, 0, 0)) - at(p - vec3(d.x, 0, 0)), at(p + vec3(0, d.y, 0)) - at(p - vec3(0, d.y, 0)),
              at(p + vec3(0, 0, d.z)) - at(p - vec3(0, 0, d.z))) * texels / size;
}

vec3 shade(vec3 tint, vec3 n) {
  vec3 toward = turn * vec3(0, 0, 1), light = normalize(turn * vec3(-0.4, 0.5, 1.0));
  float diffuse = max(dot(n, light), 0.0), shine = pow(max(dot(n, normalize(light + toward)), 0.0), 40.0);
  return tint * (0.16 + 0.8 * diffuse) + 0.22 * shine;
}

// The interfaces through which a ray enters a material from lower values, or from what is not drawn.
vec3 materials(vec3 start, vec3 direction, float t, float leave, float step) {
  vec3 light = vec3(0);
  float through = 1.0, before = t;
  int last = -1;
  for (; t < leave && through > 0.01; t += step) {
    // Several of them may lie in one step.
    for (int i = 0; i < 4; ++i) {
      int now = classAt(start + t * direction);
      if (now == last) break;
      float from = before, to = t;
      for (int j = 0; j < 6 && last >= 0; ++j) {
        float middle = 0.5 * (from + to);
        if (classAt(start + middle * direction) != last) to = middle; else from = middle;
      }
      vec3 p = start + to * direction, n = slope(p);
      now = classAt(p);
      vec4 tint = tints[now];
      if (tint.a > 0.0 && (last < 0 || now > last || tints[last].a == 0.0)) {
        float l = length(n);
        n = last < 0 || l == 0.0 ? turn * vec3(0, 0, 1) : now > last ? -n / l : n / l;
        light += through * tint.a * shade(tint.rgb, n);
        through *= 1.0 - tint.a;
      }
      last = now;
      before = to;
    }
    before = t;
  }
  return light;
}

// The places where a ray enters values from the level on; through each of them, it sees the next one.
vec3 surface(vec3 start, vec3 direction, float enter, float t, float leave, float step, bool isCut) {
  vec3 light = vec3(0);
  float through = 1.0, before = -1.0;
  bool isInside = false;
  // A face that was cut has the colors of its values.
  if (isCut && at(start + enter * direction) >= level) {
    light = opacity * colorOf(greyAt(start + enter * direction));
    through = 1.0 - opacity;
    isInside = true;
  }
  for (; t < leave && through > 0.01; t += step) {
    float now = at(start + t * direction);
    if (now >= level && !isInside) {
      float from = before < 0.0 ? t : before, to = t;
      for (int i = 0; i < 6; ++i) {
        float middle = 0.5 * (from + to);
        if (at(start + middle * direction) >= level) to = middle; else from = middle;
      }
      vec3 p = start + to * direction, n = slope(p);
      float l = length(n);
      n = before < 0.0 || l == 0.0 ? turn * vec3(0, 0, 1) : -n / l;
      light += through * opacity * shade(tint, n);
      through *= 1.0 - opacity;
    }
    isInside = now >= level;
    before = t;
  }
  return light;
}

void main() {
  vec3 direction = turn * vec3(0, 0, -1) / size;
  vec3 start = turn * vec3(place * span, 2.0) / size + 0.5;
  vec3 a = (cropLow - start) / direction, b = (cropHigh - start) / direction;
  vec3 low = min(a, b), high = max(a, b);
  float enter = max(max(low.x, low.y), low.z), leave = min(min(high.x, high.y), high.z);
  vec3 first = min(-start / direction, (1.0 - start) / direction);
  bool isCut = enter > max(max(first.x, first.y), first.z) + 1e-5;
  color = vec4(0.0, 0.0, 0.0, 1.0);
  if (enter >= leave) return;
  float step = stretch / length(direction * texels);
  // Without it, the regular steps of all rays would draw rings.
  float t = enter + step * fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453);
  if (endCount > 0) {
    color = vec4(materials(start, direction, t, leave, step), 1.0);
    return;
  }
  if (isSurface) {
    color = vec4(surface(start, direction, enter, t, leave, step, isCut), 1.0);
    return;
  }
  vec3 light = vec3(0);
  float through = 1.0;
  for (; t < leave && through > 0.01; t += step) {
    float g = greyAt(start + t * direction);
    float opaque = 1.0 - pow(1.0 - min(density * g * g, 0.98), stretch);
    light += through * opaque * colorOf(g);
    through *= 1.0 - opaque;
  }
  color = vec4(light, 1.0);
}`;
