// Programs, buffers and the picking target.

function makeProgram(gl, name, vertexParts, fragmentParts) {
  const program = gl.createProgram();
  const head = "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2D;\n";
  const kinds = [[gl.VERTEX_SHADER, vertexParts], [gl.FRAGMENT_SHADER, fragmentParts]];
  for (const [kind, parts] of kinds) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, head + parts.map((p) => SHADERS[p]).join("\n"));
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
      throw new Error(`${name}: ${gl.getShaderInfoLog(shader)}`);
    }
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    throw new Error(`${name}: ${gl.getProgramInfoLog(program)}`);
  }
  const at = new Map();
  const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < count; i++) {
    const { name: uniform } = gl.getActiveUniform(program, i);
    at.set(uniform, gl.getUniformLocation(program, uniform));
  }
  // Sets those of the given values that the program uses.
  const set = (values) => {
    for (const [uniform, value] of Object.entries(values)) {
      const place = at.get(uniform);
      if (place === undefined) continue;
      if (INTEGER_UNIFORMS.has(uniform)) gl.uniform1i(place, value);
      else if (typeof value === "number") gl.uniform1f(place, value);
      else if (value.length === 16) gl.uniformMatrix4fv(place, false, value);
      else gl[`uniform${value.length}fv`](place, value);
    }
  };
  return { program, set };
}

const INTEGER_UNIFORMS = new Set(["uMap", "uMode", "uBrush", "uPart"]);

function makePrograms(gl) {
  return {
    surface: makeProgram(gl, "surface", ["surface.vert"], ["colour.glsl", "surface.frag"]),
    diagram: makeProgram(gl, "diagram", ["diagram.vert"], ["colour.glsl", "diagram.frag"]),
    line: makeProgram(gl, "line", ["line.vert"], ["line.frag"]),
    thin: makeProgram(gl, "thin", ["thin.vert"], ["line.frag"]),
    pick: makeProgram(gl, "pick", ["pick.vert"], ["pick.frag"]),
  };
}

// Both colour maps as one texture of two rows.
function makeMapTexture(gl, maps) {
  const pixels = new Uint8Array(256 * 2 * 4);
  [maps.signed, maps.magnitude].forEach((map, row) => {
    map.forEach((hex, i) => pixels.set([...rgbOf(hex).map((c) => Math.round(255 * c)), 255], 4 * (256 * row + i)));
  });
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 2, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
  return texture;
}

const rgbOf = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);

// Buffers of one stage. Those that depend on what is shown are filled by `fillAttribute`.
function uploadStage(gl, stage) {
  const gpu = { vao: gl.createVertexArray(), buffers: {}, lines: new Map() };
  gl.bindVertexArray(gpu.vao);
  const attribute = (name, place, size, type = gl.FLOAT, normalised = false) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, normalised, 0, 0);
    gpu.buffers[name] = buffer;
  };
  attribute("position", 0, 3);
  gl.bufferData(gl.ARRAY_BUFFER, stage.positions, gl.STATIC_DRAW);
  attribute("normal", 1, 3);
  gl.bufferData(gl.ARRAY_BUFFER, stage.normals, gl.STATIC_DRAW);
  attribute("value", 2, 1);
  attribute("iso", 3, 2);
  attribute("diagram", 4, 2);
  attribute("selected", 5, 1, gl.UNSIGNED_BYTE, true);
  attribute("group", 6, 4, gl.UNSIGNED_BYTE, true);
  gl.bindVertexArray(null);
  gpu.fine = uploadTriangles(gl, stage.triangles);
  return gpu;
}

// Triangles as indices; drawn with the vertices that are bound.
function uploadTriangles(gl, corners) {
  const buffer = gl.createBuffer();
  gl.bindVertexArray(null);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
  return {
    draw: (kind = gl.TRIANGLES) => {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
      gl.drawElements(kind, corners.length, gl.UNSIGNED_INT, 0);
    },
  };
}

// More segments than this are drawn one pixel wide, which costs a fraction of wide ones.
const WIDE_SEGMENTS = 12000;

function uploadSegments(gl, segments) {
  const vao = gl.createVertexArray();
  const count = segments.length / 6;
  const thin = count > WIDE_SEGMENTS;
  gl.bindVertexArray(vao);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, segments, gl.STATIC_DRAW);
  for (const [place, offset] of thin ? [[0, 0]] : [[0, 0], [1, 12]]) {
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 3, gl.FLOAT, false, thin ? 12 : 24, offset);
    gl.vertexAttribDivisor(place, thin ? 0 : 1);
  }
  gl.bindVertexArray(null);
  return { vao, count, thin };
}

function fillAttribute(gl, gpu, name, data) {
  gl.bindBuffer(gl.ARRAY_BUFFER, gpu.buffers[name]);
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
}

// An off-screen target that holds the number of a vertex per pixel.
function makePickTarget(gl) {
  const target = { frame: gl.createFramebuffer(), width: 0, height: 0 };
  const colour = gl.createRenderbuffer();
  const depth = gl.createRenderbuffer();
  target.resize = (width, height) => {
    if (target.width === width && target.height === height) return;
    Object.assign(target, { width, height });
    gl.bindRenderbuffer(gl.RENDERBUFFER, colour);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, width, height);
    gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
    gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.frame);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, colour);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  };
  return target;
}
