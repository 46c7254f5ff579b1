// Draws a .glb of ours with WebGL: nodes with coloured meshes, moved by rotations and translations of its one animation.
const UP = [0, 0, 1];

export class Stage {
  constructor(canvas, bytes) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
    this.ok = !!this.gl;
    if (!this.ok) return;
    this.read(bytes);
    this.turn = { around: -0.9, over: 0.25, far: 3.2 }; // of the eye [rad, rad, m]
    this.program = link(this.gl);
    this.upload();
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }
  read(bytes) {
    const view = new DataView(bytes.buffer), length = view.getUint32(12, true);
    this.tree = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + length)));
    const data = 28 + length, width = { SCALAR: 1, VEC3: 3, VEC4: 4 };
    this.arrays = this.tree.accessors.map((each) => {
      const at = data + (this.tree.bufferViews[each.bufferView].byteOffset || 0), n = each.count * width[each.type];
      const part = bytes.slice(at, at + 4 * n).buffer;
      return each.componentType === 5125 ? new Uint32Array(part) : new Float32Array(part);
    });
    const { channels, samplers } = this.tree.animations ? this.tree.animations[0] : { channels: [], samplers: [] };
    this.moves = channels.map(({ sampler, target }) => ({ ...target, times: this.arrays[samplers[sampler].input], values: this.arrays[samplers[sampler].output] }));
    this.root = (this.moves.find((each) => each.path === "translation") || { node: 0 }).node;
  }
  upload() {
    const gl = this.gl, buffer = (kind, values) => {
      const made = gl.createBuffer();
      gl.bindBuffer(kind, made);
      gl.bufferData(kind, values, gl.STATIC_DRAW);
      return made;
    };
    gl.getExtension("OES_element_index_uint");
    this.meshes = this.tree.meshes.map(({ primitives: [{ attributes, indices, material }] }) => ({
      places: buffer(gl.ARRAY_BUFFER, this.arrays[attributes.POSITION]),
      normals: buffer(gl.ARRAY_BUFFER, this.arrays[attributes.NORMAL]),
      faces: buffer(gl.ELEMENT_ARRAY_BUFFER, this.arrays[indices]),
      n: this.arrays[indices].length,
      colour: this.tree.materials[material].pbrMetallicRoughness.baseColorFactor.map((each) => each ** (1 / 2.2)),
    }));
    const floor = [];
    for (let k = -10; k <= 10; k++) floor.push(k, -10, 0, k, 10, 0, -10, k, 0, 10, k, 0);
    this.floor = { places: buffer(gl.ARRAY_BUFFER, new Float32Array(floor)), n: floor.length / 3 };
  }
  listen() {
    let last = null;
    this.canvas.addEventListener("pointerdown", (event) => { last = event; this.canvas.setPointerCapture(event.pointerId); });
    this.canvas.addEventListener("pointerup", () => { last = null; });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      this.turn.around -= (event.clientX - last.clientX) / 120;
      this.turn.over = Math.max(-1.5, Math.min(1.5, this.turn.over + (event.clientY - last.clientY) / 120));
      last = event;
      this.draw();
    });
    this.canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.turn.far = Math.max(0.5, Math.min(30, this.turn.far * Math.exp(event.deltaY / 800)));
      this.draw();
    }, { passive: false });
  }
  show(seconds) { this.seconds = seconds; this.draw(); }
  posed() { // every node's matrix, in our own axes, z up: the node above them all is left out
    const own = this.tree.nodes.map(({ rotation, translation, scale }) => ({ rotation: rotation || [0, 0, 0, 1], translation: translation || [0, 0, 0], scale: scale || [1, 1, 1] }));
    own[0].rotation = [0, 0, 0, 1];
    for (const { node, path, times, values } of this.moves) {
      let k = 0;
      if (path === "scale") { while (k + 1 < times.length && times[k + 1] <= this.seconds + 1e-6) k++; }
      else for (let j = 1; j < times.length; j++) if (Math.abs(times[j] - this.seconds) < Math.abs(times[k] - this.seconds)) k = j;
      const n = values.length / times.length;
      own[node][path] = Array.from(values.subarray(n * k, n * k + n));
    }
    const world = [];
    const visit = (node, above) => {
      world[node] = product(above, matrixOf(own[node]));
      for (const child of this.tree.nodes[node].children || []) visit(child, world[node]);
    };
    visit(0, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    return world;
  }
  draw() {
    if (!this.ok || this.seconds === undefined) return;
    const gl = this.gl, { canvas, program } = this, box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
    if (!box.width) return;
    Object.assign(canvas, { width: Math.round(box.width * ratio), height: Math.round(box.height * ratio) });
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0.96, 0.965, 0.97, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(program);
    const world = this.posed(), middle = world[this.root].slice(12, 15), { around, over, far } = this.turn;
    const eye = [Math.cos(around) * Math.cos(over), Math.sin(around) * Math.cos(over), Math.sin(over)].map((each, k) => middle[k] + far * each);
    const seen = product(perspective(canvas.width / canvas.height), lookAt(eye, middle));
    const at = (name) => gl.getUniformLocation(program, name), place = gl.getAttribLocation(program, "place"), normal = gl.getAttribLocation(program, "normal");
    gl.uniformMatrix4fv(at("seen"), false, seen);
    gl.uniform3fv(at("eye"), eye);
    const put = (matrix, colour, isLit) => {
      gl.uniformMatrix4fv(at("world"), false, matrix);
      gl.uniform3fv(at("colour"), colour.slice(0, 3));
      gl.uniform1f(at("lit"), isLit);
    };
    const use = (buffer, slot) => { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.enableVertexAttribArray(slot); gl.vertexAttribPointer(slot, 3, gl.FLOAT, false, 0, 0); };
    put([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, Math.round(middle[0]), Math.round(middle[1]), 0, 1], [0.8, 0.82, 0.84], 0);
    use(this.floor.places, place);
    use(this.floor.places, normal);
    gl.drawArrays(gl.LINES, 0, this.floor.n);
    this.tree.nodes.forEach(({ mesh }, node) => {
      if (mesh === undefined) return;
      const each = this.meshes[mesh];
      put(world[node], each.colour, 1);
      use(each.places, place);
      use(each.normals, normal);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, each.faces);
      gl.drawElements(gl.TRIANGLES, each.n, gl.UNSIGNED_INT, 0);
    });
  }
}

function link(gl) {
  const program = gl.createProgram();
  const add = (kind, text) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  };
  add(gl.VERTEX_SHADER, `attribute vec3 place, normal; uniform mat4 seen, world; varying vec3 n, p;
    void main() { vec4 q = world * vec4(place, 1.0); p = q.xyz; n = mat3(world) * normal; gl_Position = seen * q; }`);
  add(gl.FRAGMENT_SHADER, `precision mediump float; uniform vec3 colour, eye; uniform float lit; varying vec3 n, p;
    void main() {
      float shade = lit < 0.5 ? 1.0 : 0.45 + 0.55 * abs(dot(normalize(n), normalize(eye - p + vec3(0.0, 0.0, 1.0))));
      gl_FragColor = vec4(colour * shade, 1.0);
    }`);
  gl.linkProgram(program);
  return program;
}

// 4 x 4 matrices by columns, as WebGL has them
function product(a, b) {
  const c = new Array(16).fill(0);
  for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}

function matrixOf({ rotation: [x, y, z, w], translation: [a, b, c], scale: [p, q, r] }) {
  return [
    p * (1 - 2 * (y * y + z * z)), p * 2 * (x * y + z * w), p * 2 * (x * z - y * w), 0,
    q * 2 * (x * y - z * w), q * (1 - 2 * (x * x + z * z)), q * 2 * (y * z + x * w), 0,
    r * 2 * (x * z + y * w), r * 2 * (y * z - x * w), r * (1 - 2 * (x * x + y * y)), 0,
    a, b, c, 1,
  ];
}

function perspective(aspect) {
  const near = 0.05, far = 100, f = 1.9;
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0];
}

function lookAt(eye, to) {
  const unit = (v) => v.map((each) => each / Math.hypot(...v)), cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const back = unit(eye.map((each, k) => each - to[k])), right = unit(cross(UP, back)), up = cross(back, right);
  const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
  return [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, dot(right), dot(up), dot(back), 1];
}
