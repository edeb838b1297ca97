// Parts: surfaces at a step, their images in symmetry planes, sections, and the place under the pointer.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// Images of a part: each maps p to flip * p + offset.
function imagesOf(mirrors) {
  let images = [{ flip: [1, 1, 1], offset: [0, 0, 0] }];
  for (const [axis, at] of mirrors) {
    const more = images.map(({ flip, offset }) => {
      const [f, o] = [[...flip], [...offset]];
      [f[axis], o[axis]] = [-f[axis], 2 * at - o[axis]];
      return { flip: f, offset: o };
    });
    images = images.concat(more);
  }
  return images;
}

// Normals at points: of the triangles around each, by area.
function normalsOf(points, triangles) {
  const out = new Float32Array(points.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [i, j, k] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const ux = points[j] - points[i], uy = points[j + 1] - points[i + 1], uz = points[j + 2] - points[i + 2];
    const vx = points[k] - points[i], vy = points[k + 1] - points[i + 1], vz = points[k + 2] - points[i + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (let c = 0; c < 3; c++) {
      const at = c === 0 ? i : c === 1 ? j : k;
      out[at] += nx;
      out[at + 1] += ny;
      out[at + 2] += nz;
    }
  }
  return out;
}

// Tuples of `width` numbers, in the order of `ids`.
function gathered(values, ids, width) {
  const out = new Float32Array(ids.length * width);
  for (let k = 0; k < ids.length; k++) {
    for (let c = 0; c < width; c++) out[k * width + c] = values[ids[k] * width + c];
  }
  return out;
}

class Part {
  static async load(spec) {
    const part = new Part();
    Object.assign(part, { name: spec.name, visibility: spec.visibility, cellName: spec.cellName, numbering: spec.numbering });
    part.images = imagesOf(spec.mirrors);
    [part.triangles, part.cells, part.numbers, part.edges, part.points] = await Promise.all([
      numbers(spec.triangles), numbers(spec.cells), numbers(spec.numbers), numbers(spec.edges), places(spec.points),
    ]);
    part.fields = await Promise.all(spec.fields.map(async (field) => ({
      name: field.name, cells: field.cells, values: await numbers(field.values),
    })));
    part.frames = await Promise.all(spec.frames.map(async (frame) => ({
      shift: frame.shift,
      points: frame.points ? await places(frame.points) : part.points,
      values: await Promise.all(frame.values.map(numbers)),
    })));
    part.frames.push({ shift: [0, 0, 0], points: part.points, values: part.fields.map((field) => field.values) });
    return part;
  }

  // State at a step; parts without steps of their own keep the last.
  frame(step) {
    return this.frames[Math.min(step, this.frames.length - 1)];
  }

  // A field by its name: whether it has a value per cell, and its values at a step.
  field(name, step) {
    const index = this.fields.findIndex((field) => field.name === name);
    if (index < 0) return null;
    const frame = this.frame(step);
    return { cells: this.fields[index].cells, values: frame.values[index] ?? this.fields[index].values };
  }

  // Values at the corners of the triangles.
  cornerValues(name, step) {
    const field = this.field(name, step);
    if (!field) return null;
    const { triangles, cells } = this;
    const out = new Float32Array(triangles.length);
    for (let k = 0; k < out.length; k++) {
      const value = field.values[field.cells ? cells[Math.floor(k / 3)] : triangles[k]];
      out[k] = Number.isFinite(value) ? value : MISSING_VALUE;
    }
    return out;
  }

  imagesShown(whole) {
    return whole ? this.images : this.images.slice(0, 1);
  }

  // Box around the part and its images at all steps: smallest and largest coordinates.
  box() {
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    for (const { points, shift } of this.frames) {
      for (let k = 0; k < points.length; k++) {
        const x = points[k] + shift[k % 3];
        if (x < low[k % 3]) low[k % 3] = x;
        if (x > high[k % 3]) high[k % 3] = x;
      }
    }
    for (const { flip, offset } of this.images.slice(1)) {
      for (let c = 0; c < 3; c++) {
        const ends = [low[c], high[c]].map((x) => flip[c] * x + offset[c]);
        [low[c], high[c]] = [Math.min(low[c], ...ends), Math.max(high[c], ...ends)];
      }
    }
    return [low, high];
  }

  // Extent along axes of the part at a step, with its images: smallest and largest coordinate on each.
  extent(step, whole, axes) {
    const { points, shift } = this.frame(step);
    const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
    for (const { flip, offset } of this.imagesShown(whole)) {
      axes.forEach((axis, c) => {
        const [a, b, d] = axis.map((x, k) => flip[k] * x);
        const base = dot(axis, offset) + a * shift[0] + b * shift[1] + d * shift[2];
        for (let k = 0; k < points.length; k += 3) {
          const x = base + a * points[k] + b * points[k + 1] + d * points[k + 2];
          if (x < low[c]) low[c] = x;
          if (x > high[c]) high[c] = x;
        }
      });
    }
    return [low, high];
  }

  // Line segments in which the plane cuts the part: x, y, z of both ends.
  section(step, whole, axis, at) {
    const { points, shift } = this.frame(step);
    const { triangles } = this;
    const out = [];
    for (const { flip, offset } of this.imagesShown(whole)) {
      const place = (id) => [0, 1, 2].map((c) => flip[c] * (points[3 * id + c] + shift[c]) + offset[c]);
      const height = (id) => flip[axis] * (points[3 * id + axis] + shift[axis]) + offset[axis] - at;
      for (let t = 0; t < triangles.length; t += 3) {
        const ids = [triangles[t], triangles[t + 1], triangles[t + 2]];
        const heights = ids.map(height);
        const above = heights.filter((h) => h > 0).length;
        if (above === 0 || above === 3) continue;
        for (let k = 0; k < 3; k++) {
          const next = (k + 1) % 3;
          if (heights[k] > 0 === heights[next] > 0) continue;
          const f = heights[k] / (heights[k] - heights[next]);
          const [a, b] = [place(ids[k]), place(ids[next])];
          for (let c = 0; c < 3; c++) out.push(a[c] + f * (b[c] - a[c]));
        }
      }
    }
    return new Float32Array(out);
  }

  // The place nearest to the eye on the line through `from` against `eye`; `keeps`: whether a place is not cut away.
  pick(step, whole, from, eye, keeps) {
    let best = null;
    for (const image of this.imagesShown(whole)) {
      const hit = this.pickImage(step, image, from, eye, keeps);
      if (hit && (!best || hit.depth > best.depth)) best = hit;
    }
    return best;
  }

  pickImage(step, image, from, eye, keeps) {
    const { flip, offset } = image;
    const { points, shift } = this.frame(step);
    const { triangles } = this;
    const o = [0, 1, 2].map((c) => flip[c] * (from[c] - offset[c]) - shift[c]);
    const d = eye.map((x, c) => flip[c] * x);
    let best = null;
    for (let t = 0; t < triangles.length; t += 3) {
      const [i, j, k] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
      const [ax, ay, az] = [points[i], points[i + 1], points[i + 2]];
      const [ux, uy, uz] = [points[j] - ax, points[j + 1] - ay, points[j + 2] - az];
      const [vx, vy, vz] = [points[k] - ax, points[k + 1] - ay, points[k + 2] - az];
      // Möller and Trumbore: barycentric coordinates and distance by Cramer's rule.
      const [px, py, pz] = [d[1] * vz - d[2] * vy, d[2] * vx - d[0] * vz, d[0] * vy - d[1] * vx];
      const det = ux * px + uy * py + uz * pz;
      if (det === 0) continue;
      const [sx, sy, sz] = [o[0] - ax, o[1] - ay, o[2] - az];
      const u = (sx * px + sy * py + sz * pz) / det;
      if (u < 0 || u > 1) continue;
      const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
      const v = (d[0] * qx + d[1] * qy + d[2] * qz) / det;
      if (v < 0 || u + v > 1) continue;
      const depth = (vx * qx + vy * qy + vz * qz) / det;
      if (best && depth <= best.depth) continue;
      const place = from.map((x, c) => x + depth * eye[c]);
      if (keeps(place)) best = { part: this, image, triangle: t / 3, weights: [1 - u - v, u, v], place, depth };
    }
    return best;
  }

  // What is at a picked place: the place at this step, number of the cell and of the nearest point, and the values there.
  describe(hit, name, step) {
    const ids = [0, 1, 2].map((k) => this.triangles[3 * hit.triangle + k]);
    const nearest = hit.weights.indexOf(Math.max(...hit.weights));
    const cell = this.cells[hit.triangle];
    const [first, stride] = this.numbering;
    const { points, shift } = this.frame(step);
    const { flip, offset } = hit.image;
    const along = (c) => ids.reduce((sum, id, k) => sum + hit.weights[k] * points[3 * id + c], 0);
    const place = [0, 1, 2].map((c) => flip[c] * (along(c) + shift[c]) + offset[c]);
    const out = { place, cell: this.numbers[cell], point: first + stride * ids[nearest], value: null, pointValue: null };
    const field = name && this.field(name, step);
    if (field && field.cells) out.value = field.values[cell];
    if (field && !field.cells) {
      out.value = ids.reduce((sum, id, k) => sum + hit.weights[k] * field.values[id], 0);
      out.pointValue = field.values[ids[nearest]];
    }
    return out;
  }
}
