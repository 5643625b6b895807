// What is drawn with WebGL: shaded meshes, the bed with its grid, the water, and lines of a width in pixels.

const MESH = `#version 300 es
uniform mat4 view, model;
in vec3 place, normal;
out vec3 at, n;
void main() {
  vec4 world = model * vec4(place, 1.0);
  at = world.xyz;
  n = mat3(model) * normal;
  gl_Position = view * world;
}`;

const SHADED = `#version 300 es
precision highp float;
uniform vec3 color, eye, middle;
uniform float alpha, reach, cell;
uniform int kind; // 0 a body, 1 the bed, 2 the water
in vec3 at, n;
out vec4 shown;
float lines(vec2 p) {
  vec2 d = abs(fract(p - 0.5) - 0.5) / max(fwidth(p), 1e-6);
  return 1.0 - min(min(d.x, d.y), 1.0);
}
void main() {
  vec3 normal = normalize(n), look = normalize(eye - at);
  if (dot(normal, look) < 0.0) normal = -normal;
  float sun = max(dot(normal, normalize(vec3(0.36, -0.48, 0.8))), 0.0);
  vec3 c = color * (0.55 + 0.25 * (0.5 + 0.5 * normal.z) + 0.35 * sun);
  float a = alpha;
  if (kind > 0) {
    float edge = length(at.xy - middle.xy) / reach;
    a *= 1.0 - smoothstep(0.72, 1.0, edge);
  }
  if (kind == 1) {
    float close = 1.0 - smoothstep(0.2, 0.7, max(fwidth(at.x / cell), fwidth(at.y / cell)));
    c = mix(c, c * 0.72, close * lines(at.xy / cell));
  }
  if (kind == 2) {
    float glance = pow(1.0 - abs(dot(normal, look)), 3.0);
    vec3 bounce = reflect(-look, normal);
    float gleam = pow(max(dot(bounce, normalize(vec3(0.36, -0.48, 0.8))), 0.0), 24.0);
    c = color * (0.62 + 0.5 * sun) + 0.22 * glance + 0.35 * gleam;
    float close = 1.0 - smoothstep(0.1, 0.5, max(fwidth(at.x / cell), fwidth(at.y / cell)));
    c += 0.10 * close * lines(at.xy / cell); // a net that shows its slopes
    a = mix(a, min(a * 1.7, 0.95), glance) * (1.0 - smoothstep(0.72, 1.0, length(at.xy - middle.xy) / reach));
  }
  shown = vec4(c * a, a);
}`;

const SEGMENTS = `#version 300 es
uniform mat4 view;
uniform vec2 size; // of the canvas in pixels
in vec2 corner;    // which end, which side
in vec3 from, to;
in vec3 fromColor, toColor;
in vec2 width;
out vec3 color;
void main() {
  vec4 a = view * vec4(from, 1.0), b = view * vec4(to, 1.0);
  float near = 1e-3;
  if (a.w < near && b.w > near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  if (b.w < near && a.w > near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * size;
  along = length(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
  vec4 end = corner.x < 0.5 ? a : b;
  float w = corner.x < 0.5 ? width.x : width.y;
  vec2 shift = (vec2(-along.y, along.x) * corner.y + along * (corner.x - 0.5) * 0.5) * w / size;
  gl_Position = vec4(end.xy + shift * end.w, end.z, end.w);
  color = corner.x < 0.5 ? fromColor : toColor;
}`;

const PLAIN = `#version 300 es
precision highp float;
in vec3 color;
out vec4 shown;
void main() { shown = vec4(color, 1.0); }`;

const IDENTITY = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);

/** Draws into a canvas.  Throws an Error where there is no WebGL 2. */
export class Painter {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no context");
    Object.assign(this, { gl, canvas });
    this.mesh = program(gl, MESH, SHADED);
    this.segment = program(gl, SEGMENTS, PLAIN);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.corners = buffer(gl, new Float32Array([0, -1, 0, 1, 1, -1, 1, 1]));
    this.instances = gl.createBuffer();
    this.array = gl.createVertexArray();
  }

  begin(camera) {
    const { gl, canvas } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (w && h && (canvas.width !== w || canvas.height !== h)) Object.assign(canvas, { width: w, height: h });
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.ratio = ratio;
    this.view = camera.matrix(canvas.width / canvas.height);
    this.eye = camera.position;
  }

  /** Where a point of the world is in the canvas, as shares of its width and height; null behind the viewer. */
  project([x, y, z]) {
    const m = this.view;
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    if (w <= 0) return null;
    const at = (i) => (m[i] * x + m[4 + i] * y + m[8 + i] * z + m[12 + i]) / w;
    return [(1 + at(0)) / 2, (1 - at(1)) / 2];
  }

  /** A mesh to be drawn many times: {places, normals, triangles}, arrays. */
  keep({ places, normals, triangles }, moving = false) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const kept = { array, count: triangles.length, places: buffer(gl, new Float32Array(places), moving) };
    attribute(gl, this.mesh, "place", 3);
    kept.normals = buffer(gl, new Float32Array(normals), moving);
    attribute(gl, this.mesh, "normal", 3);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(triangles), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return kept;
  }

  /** Other places and normals of a mesh that was kept as moving. */
  change(kept, places, normals) {
    const { gl } = this;
    for (const [target, values] of [[kept.places, places], [kept.normals, normals]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, target);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, values);
    }
  }

  /** how: {color, alpha, model, kind, middle, reach, cell}. */
  draw(kept, how) {
    const { gl, mesh } = this;
    const set = { color: [1, 1, 1], alpha: 1, model: IDENTITY, kind: 0, middle: [0, 0, 0], reach: 1, cell: 1, ...how };
    gl.useProgram(mesh);
    const at = (name) => gl.getUniformLocation(mesh, name);
    gl.uniformMatrix4fv(at("view"), false, this.view);
    gl.uniformMatrix4fv(at("model"), false, set.model);
    for (const name of ["color", "middle"]) gl.uniform3fv(at(name), set[name]);
    gl.uniform3fv(at("eye"), this.eye);
    for (const name of ["alpha", "reach", "cell"]) gl.uniform1f(at(name), set[name]);
    gl.uniform1i(at("kind"), set.kind);
    gl.depthMask(set.kind === 0);
    gl.bindVertexArray(kept.array);
    gl.drawElements(gl.TRIANGLES, kept.count, gl.UNSIGNED_INT, 0);
    gl.depthMask(true);
    gl.bindVertexArray(null);
  }

  /** Segments of a width in CSS pixels: 14 numbers each, from, to, their colours and widths. */
  drawSegments(numbers) {
    const { gl, segment } = this;
    if (!numbers.length) return;
    gl.useProgram(segment);
    gl.uniformMatrix4fv(gl.getUniformLocation(segment, "view"), false, this.view);
    gl.uniform2f(gl.getUniformLocation(segment, "size"), this.canvas.width / this.ratio, this.canvas.height / this.ratio);
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
    attribute(gl, segment, "corner", 2);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.STREAM_DRAW);
    let offset = 0;
    for (const [name, size] of [["from", 3], ["to", 3], ["fromColor", 3], ["toColor", 3], ["width", 2]]) {
      attribute(gl, segment, name, size, 56, offset, 1);
      offset += 4 * size;
    }
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, numbers.length / 14);
    gl.bindVertexArray(null);
  }
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) || "WebGL: no program");
  return made;
}

function buffer(gl, values, moving = false) {
  const made = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  gl.bufferData(gl.ARRAY_BUFFER, values, moving ? gl.DYNAMIC_DRAW : gl.STATIC_DRAW);
  return made;
}

function attribute(gl, made, name, size, stride = 0, offset = 0, each = 0) {
  const place = gl.getAttribLocation(made, name);
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, offset);
  gl.vertexAttribDivisor(place, each);
}
