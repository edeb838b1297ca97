// Drawing by WebGL2. All views of a page share one context, since browsers allow few; its picture is copied to each view.

const MISSING_VALUE = -1e30;

const VERTEX = `#version 300 es
in vec3 position;
in vec3 normal;
in float value;
uniform mat3 axes;
uniform vec3 flip, offset, shift, centre, scale;
out vec3 place, direction;
out float quantity;
void main() {
  place = flip * (position + shift) + offset;
  direction = (flip * normal) * axes;
  quantity = value;
  vec3 seen = (place - centre) * axes * scale;
  gl_Position = vec4(seen.xy, -seen.z, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 place, direction;
in float quantity;
uniform sampler2D colors;
uniform float entries, bands;
uniform vec2 limits;
uniform vec4 plain, clip;
uniform bool valued, lit;
out vec4 color;
vec3 base() {
  if (!valued) return plain.rgb;
  if (quantity < -1e20) return vec3(0.47);
  float t = limits.y > limits.x ? clamp((quantity - limits.x) / (limits.y - limits.x), 0.0, 1.0) : 0.5;
  if (bands > 0.0) t = (min(floor(t * bands), bands - 1.0) + 0.5) / bands;
  return texture(colors, vec2((t * (entries - 1.0) + 0.5) / entries, 0.5)).rgb;
}
void main() {
  if (dot(clip.xyz, place) > clip.w) discard;
  vec3 n = normalize(direction);
  float facing = abs(dot(n, normalize(vec3(0.2, 0.35, 0.92))));
  color = vec4(base() * (lit ? 0.45 + 0.55 * facing : 1.0), plain.a);
}`;

class Device {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.gl = this.canvas.getContext("webgl2", { antialias: true, alpha: true });
    if (!this.gl) throw new Error("no WebGL2");
    this.setUp();
  }

  // Programs and tables; again after a lost context. What is made before has another generation.
  setUp() {
    const { gl } = this;
    this.generation = (this.generation ?? 0) + 1;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    ["position", "normal", "value"].forEach((name, k) => gl.bindAttribLocation(program, k, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "lost");
    gl.useProgram(program);
    this.uniforms = {};
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const { name } = gl.getActiveUniform(program, k);
      this.uniforms[name] = gl.getUniformLocation(program, name);
    }
    gl.enable(gl.DEPTH_TEST);
    gl.polygonOffset(1, 1);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const [key, value] of [["MIN_FILTER", "LINEAR"], ["MAG_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]]) {
      gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${key}`], gl[value]);
    }
  }

  colors(table) {
    const { gl, uniforms } = this;
    const texels = new Uint8Array(table.flatMap((color) => [...color, 255]));
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, table.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, texels);
    gl.uniform1f(uniforms.entries, table.length);
  }

  // Attributes of vertices: each an array and the numbers per vertex.
  mesh(arrays) {
    const { gl } = this;
    const vao = gl.createVertexArray();
    const buffers = arrays.map(() => gl.createBuffer());
    const mesh = { vao, buffers, count: 0 };
    arrays.forEach((array, k) => this.fill(mesh, k, array));
    return mesh;
  }

  fill(mesh, k, [data, width]) {
    const { gl } = this;
    gl.bindVertexArray(mesh.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.buffers[k]);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(k);
    gl.vertexAttribPointer(k, width, gl.FLOAT, false, 0, 0);
    if (k === 0) mesh.count = data.length / width;
  }

  // Size of the picture [px]; the shared canvas only grows.
  begin(width, height) {
    const { gl, canvas } = this;
    if (canvas.width < width) canvas.width = width;
    if (canvas.height < height) canvas.height = height;
    gl.viewport(0, 0, width, height);
    gl.depthMask(true);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  copyTo(context, width, height) {
    context.clearRect(0, 0, width, height);
    context.drawImage(this.canvas, 0, this.canvas.height - height, width, height, 0, 0, width, height);
  }
}

// Buffers of a part for the device: triangles with normals and values, edges, and the section.
class PartBuffers {
  constructor(device, part) {
    Object.assign(this, { device, part, generation: device.generation, shown: "", values: "", cut: "" });
    const none = new Float32Array(0);
    this.faces = device.mesh([[none, 3], [none, 3], [none, 1]]);
    this.edges = device.mesh([[none, 3]]);
    this.section = device.mesh([[none, 3]]);
  }

  update(step, name, whole, section) {
    const { device, part } = this;
    const { points } = part.frame(step);
    if (this.points !== points) {
      this.points = points;
      device.fill(this.faces, 0, [gathered(points, part.triangles, 3), 3]);
      device.fill(this.faces, 1, [gathered(normalsOf(points, part.triangles), part.triangles, 3), 3]);
      device.fill(this.edges, 0, [gathered(points, part.edges, 3), 3]);
    }
    const values = `${step} ${name}`;
    if (this.values !== values) {
      this.values = values;
      const corners = part.cornerValues(name, step);
      this.valued = corners !== null;
      device.fill(this.faces, 2, [corners ?? new Float32Array(part.triangles.length), 1]);
    }
    const cut = section ? `${step} ${whole} ${section.axis} ${section.at}` : "";
    if (this.cut !== cut) {
      this.cut = cut;
      const lines = section ? part.section(step, whole, section.axis, section.at) : new Float32Array(0);
      device.fill(this.section, 0, [lines, 3]);
    }
  }
}

// Draws a view; `scene`: camera, step, field, limits, parts and switches.
function drawScene(device, buffers, scene) {
  const { gl, uniforms } = device;
  const { camera, width, height } = scene;
  device.begin(width, height);
  gl.uniformMatrix3fv(uniforms.axes, false, camera.axes.flat());
  gl.uniform3fv(uniforms.centre, camera.centre);
  const pixels = camera.scale * scene.ratio;
  gl.uniform3f(uniforms.scale, (2 * pixels) / width, (2 * pixels) / height, 1 / camera.depth);
  device.colors(scene.colors);
  gl.uniform1f(uniforms.bands, scene.bands);
  gl.uniform2fv(uniforms.limits, scene.limits);
  const { section } = scene;
  const clip = section ? [0, 0, 0, section.side * section.at] : [0, 0, 0, 1];
  if (section) clip[section.axis] = section.side;
  const opaque = buffers.filter(({ part }) => part.visibility === "shown");
  const transparent = buffers.filter(({ part }) => part.visibility === "transparent");
  for (const [list, alpha] of [[opaque, 1], [transparent, 0.35]]) {
    gl[alpha < 1 ? "enable" : "disable"](gl.BLEND);
    gl.depthMask(alpha === 1);
    for (const one of list) {
      one.update(scene.step, scene.field, scene.whole, section);
      gl.uniform4fv(uniforms.clip, clip);
      for (const image of one.part.imagesShown(scene.whole)) drawImage(device, one, image, scene, alpha);
      gl.uniform4f(uniforms.clip, 0, 0, 0, 1);
      if (section) drawSection(device, one, scene);
    }
  }
  gl.bindVertexArray(null);
}

function drawImage(device, one, { flip, offset }, scene, alpha) {
  const { gl, uniforms } = device;
  gl.uniform3fv(uniforms.flip, flip);
  gl.uniform3fv(uniforms.offset, offset);
  gl.uniform3fv(uniforms.shift, one.part.frame(scene.step).shift);
  gl.uniform1i(uniforms.valued, one.valued ? 1 : 0);
  gl.uniform1i(uniforms.lit, 1);
  gl.uniform4f(uniforms.plain, ...one.part.tint, alpha);
  gl.enable(gl.POLYGON_OFFSET_FILL);
  gl.bindVertexArray(one.faces.vao);
  gl.drawArrays(gl.TRIANGLES, 0, one.faces.count);
  gl.disable(gl.POLYGON_OFFSET_FILL);
  if (!scene.edges) return;
  drawLines(device, one.edges, [0.05, 0.07, 0.1, alpha < 1 ? 0.35 : 1]);
}

// The section in the world's coordinates, in the colour of text.
function drawSection(device, one, scene) {
  const { gl, uniforms } = device;
  gl.uniform3f(uniforms.flip, 1, 1, 1);
  gl.uniform3f(uniforms.offset, 0, 0, 0);
  gl.uniform3f(uniforms.shift, 0, 0, 0);
  drawLines(device, one.section, [...scene.ink, 1]);
}

function drawLines(device, mesh, color) {
  const { gl, uniforms } = device;
  gl.uniform1i(uniforms.valued, 0);
  gl.uniform1i(uniforms.lit, 0);
  gl.uniform4fv(uniforms.plain, color);
  gl.bindVertexArray(mesh.vao);
  gl.drawArrays(gl.LINES, 0, mesh.count);
}
