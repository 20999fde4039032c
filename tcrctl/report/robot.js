// The robot in space: rods, rings, springs, cables by tension; wanted and actual path of its end; its task.
// Blue is slack, vermilion the largest tension of the run.
function tensionColour(share) {
  const stops = isDark() ? [[86, 180, 233], [240, 228, 66], [255, 110, 60]] : [[0, 114, 178], [214, 160, 0], [205, 60, 0]];
  const x = 2 * Math.min(1, Math.max(0, share)), i = Math.min(1, Math.floor(x));
  return `rgb(${stops[i].map((c, k) => Math.round(c + (x - i) * (stops[i + 1][k] - c))).join()})`;
}

class RobotView {
  constructor(canvas) {
    this.canvas = canvas;
    this.index = +canvas.dataset.run;
    this.run = DATA.runs[this.index];
    this.end = null;
    const { robot, path } = this.run;
    this.path = { t: floats(path.t), actual: floats(path.actual), wanted: floats(path.wanted),
      normal: path.wanted_normal && floats(path.wanted_normal) };
    if (robot) {
      this.frameT = floats(robot.t);
      this.frames = unpack(robot.nodes, Int16Array);
      const chart = DATA.charts.find((c) => c.shows === "tension" && c.run === this.index);
      this.tension = chart.lines.map((line) => floats(line.values));
      this.most = Math.max(1, ...this.tension.map((values) => values.reduce((a, b) => (b > a ? b : a), 0)));
    }
    this.seriesT = floats(this.run.t);
    this.box = this.bounds();
    this.look("space");
    this.listen();
  }

  bounds() {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    const take = (p) => { for (let k = 0; k < 3; k++) if (isFinite(p[k])) { low[k] = Math.min(low[k], p[k]); high[k] = Math.max(high[k], p[k]); } };
    for (const line of [this.path.actual, this.path.wanted])
      for (let i = 0; i < line.length; i += 3) take([line[i], line[i + 1], line[i + 2]]);
    taskCorners(this.run.task).forEach(take);
    if (this.run.robot) for (const i of [0, this.frameT.length >> 1, this.frameT.length - 1]) this.nodesAt(this.frameT[i]).forEach(take);
    return { low, high, middle: low.map((v, k) => (v + high[k]) / 2), size: Math.max(...high.map((v, k) => v - low[k]), 0.05) };
  }

  look(view) {
    const [azimuth, elevation] = { space: [-0.9, 0.28], front: [-Math.PI / 2, 0], side: [0, 0], above: [-Math.PI / 2, Math.PI / 2 - 1e-4], end: [-0.9, 0.28] }[view];
    Object.assign(this, { azimuth, elevation, zoom: 1, target: this.box.middle, view });
    this.fit();
    if (view === "end") {
      const a = this.path.actual, low = [0, 1, 2].map((k) => Infinity), high = [0, 1, 2].map((k) => -Infinity);
      for (let i = 0; i < a.length; i++) { low[i % 3] = Math.min(low[i % 3], a[i]); high[i % 3] = Math.max(high[i % 3], a[i]); }
      this.target = low.map((v, k) => (v + high[k]) / 2);
      this.zoom = Math.min(20, this.box.size / Math.max(0.05, 2.6 * Math.max(...high.map((v, k) => v - low[k]))));
    }
    this.draw();
  }

  // Pixels per metre at which all of the run is in view, seen from here.
  fit() {
    const [, right, up] = this.axes(), { low, high, middle } = this.box, most = [0.02, 0.02];
    for (let corner = 0; corner < 8; corner++) {
      const d = add([0, 1, 2].map((k) => (corner >> k & 1 ? high[k] : low[k])), middle, -1);
      most[0] = Math.max(most[0], Math.abs(dot(d, right)));
      most[1] = Math.max(most[1], Math.abs(dot(d, up)));
    }
    const { clientWidth, clientHeight } = this.canvas;
    this.whole = 0.41 * Math.min(clientWidth / most[0], clientHeight / most[1], 4 * Math.max(clientWidth, clientHeight) / this.box.size);
  }

  // Towards the viewer, to the right, and up.
  axes() {
    const ce = Math.cos(this.elevation), out = [ce * Math.cos(this.azimuth), ce * Math.sin(this.azimuth), Math.sin(this.elevation)];
    const right = [-Math.sin(this.azimuth), Math.cos(this.azimuth), 0];
    return [out, right, cross(out, right)];
  }

  // Node positions [m] at a time, on the straight line between two frames.
  nodesAt(t) {
    const robot = this.run.robot, i = indexAt(this.frameT, t), j = Math.min(i + 1, this.frameT.length - 1);
    const span = this.frameT[j] - this.frameT[i], s = span > 0 ? Math.min(1, Math.max(0, (t - this.frameT[i]) / span)) : 0;
    const nodes = [], f = this.frames, at = 3 * robot.count;
    for (let n = 0; n < robot.count; n++)
      nodes.push([0, 1, 2].map((k) => robot.middle[k] + robot.scale * ((1 - s) * f[at * i + 3 * n + k] + s * f[at * j + 3 * n + k])));
    return nodes;
  }

  draw() {
    const [c, width, height] = sharp(this.canvas);
    if (!width) return;
    const [out, right, up] = this.axes(), away = 3 * this.box.size, pixels = this.zoom * this.whole;
    this.pixels = pixels; this.right = right; this.up = up;
    this.project = (p) => {
      const d = add(p, this.target, -1), depth = dot(d, out), near = away / Math.max(0.05 * away, away - depth);
      return [width / 2 + pixels * near * dot(d, right), height / 2 - pixels * near * dot(d, up), depth];
    };
    this.segments = [];
    this.drawGround(c);
    this.drawPath(c);
    if (this.run.robot) this.drawRobot(c);
    new TaskView(c, this.project, right).draw(this.run.task, clock.t, this.end);
    this.drawAxes(c, height);
  }

  line(a, b, stroke, width, dash) {
    const p = this.project(a), q = this.project(b);
    this.segments.push({ p, q, depth: (p[2] + q[2]) / 2, stroke, width, dash });
  }

  // Far ones first, and fainter.
  flush(c) {
    this.segments.sort((a, b) => a.depth - b.depth);
    for (const s of this.segments) {
      c.globalAlpha = Math.min(1, Math.max(0.45, 0.8 + (1.2 * s.depth) / this.box.size));
      c.strokeStyle = s.stroke; c.lineWidth = s.width; c.setLineDash(s.dash || []);
      c.beginPath(); c.moveTo(s.p[0], s.p[1]); c.lineTo(s.q[0], s.q[1]); c.stroke();
    }
    c.globalAlpha = 1; c.setLineDash([]);
    this.segments = [];
  }

  drawGround(c) {
    const step = 0.1, z = this.box.low[2] - 0.03, reach = Math.ceil((0.55 * this.box.size) / step) * step, grid = colour("line");
    const x0 = Math.round(this.box.middle[0] / step) * step, y0 = Math.round(this.box.middle[1] / step) * step;
    for (let d = -reach; d <= reach + 1e-9; d += step) {
      this.line([x0 + d, y0 - reach, z], [x0 + d, y0 + reach, z], grid, 0.7);
      this.line([x0 - reach, y0 + d, z], [x0 + reach, y0 + d, z], grid, 0.7);
    }
    this.flush(c);
  }

  trace(c, line, until) {
    c.beginPath();
    let pen = false;
    for (let i = 0; i < until; i++) {
      const p = [line[3 * i], line[3 * i + 1], line[3 * i + 2]];
      if (!p.every(isFinite)) { pen = false; continue; }
      const [x, y] = this.project(p);
      if (pen) c.lineTo(x, y); else c.moveTo(x, y);
      pen = true;
    }
    c.stroke();
  }

  drawPath(c) {
    const { t, actual, wanted, normal } = this.path, now = indexAt(t, clock.t);
    c.lineWidth = 4; c.strokeStyle = colour("band"); c.lineCap = "round";
    this.trace(c, wanted, t.length);
    c.lineCap = "butt"; c.lineWidth = 1.6; c.strokeStyle = lineColour(this.index); c.globalAlpha = 0.35;
    this.trace(c, actual, t.length);
    c.globalAlpha = 1;
    this.trace(c, actual, now + 1);
    const at = [0, 1, 2].map((k) => wanted[3 * now + k]);
    if (!at.every(isFinite)) return;
    cross2d(c, ...this.project(at));
    if (normal && isFinite(normal[3 * now])) this.arrow(c, at, [0, 1, 2].map((k) => -normal[3 * now + k]), colour("ink"), [4, 3]);
  }

  arrow(c, tail, direction, stroke, dash = []) {
    const a = this.project(tail), b = this.project(add(tail, direction, 0.09)), angle = Math.atan2(b[1] - a[1], b[0] - a[0]);
    c.strokeStyle = stroke; c.lineWidth = 1.8; c.setLineDash(dash);
    c.beginPath(); c.moveTo(a[0], a[1]); c.lineTo(b[0], b[1]); c.stroke(); c.setLineDash([]);
    c.beginPath();
    for (const turn of [2.7, -2.7]) { c.moveTo(b[0], b[1]); c.lineTo(b[0] + 8 * Math.cos(angle + turn), b[1] + 8 * Math.sin(angle + turn)); }
    c.stroke();
  }

  drawRobot(c) {
    const robot = this.run.robot, nodes = this.nodesAt(clock.t), body = colour("robot"), tip = colour("tip");
    const thick = Math.min(4, Math.max(1, this.pixels * 0.004));
    const per = robot.per_module;
    let end = null;
    for (let module = 0; per * module < robot.count; module++) {
      const [a, b, d, apex] = nodes.slice(per * module, per * (module + 1)), isTip = module === robot.tip;
      const centre = scaled(add(add(a, b), d), 1 / 3), arm = add(a, centre, -1), radius = Math.hypot(...arm);
      const across = scaled(unit(add(b, d, -1)), radius), around = 24;
      const on = (k) => add(add(centre, arm, Math.cos((2 * Math.PI * k) / around)), across, Math.sin((2 * Math.PI * k) / around));
      for (let k = 0; k < around; k++) this.line(on(k), on(k + 1), isTip ? tip : body, isTip ? 1.6 * thick : 1.2 * thick);
      for (const node of [a, b, d]) this.line(node, apex, isTip ? tip : body, thick);
      if (isTip) end = { at: centre, normal: unit(cross(add(b, a, -1), add(d, b, -1))) };
    }
    this.drawSprings(nodes);
    this.drawCables(nodes, thick);
    this.flush(c);
    this.end = end;
    if (end && !this.run.task.sight) this.arrow(c, end.at, scaled(end.normal, -1), tip);
  }

  drawSprings(nodes) {
    const stroke = colour("spring"), turns = 8;
    for (const [i, j] of this.run.robot.springs) {
      const a = nodes[i], along = add(nodes[j], a, -1), side = scaled(unit(cross(along, Math.abs(along[2]) < Math.abs(along[0]) ? [0, 0, 1] : [1, 0, 0])), 0.002);
      let last = a;
      for (let k = 1; k <= turns; k++) {
        const next = add(add(a, along, (k - (k < turns ? 0.5 : 0)) / turns), side, k === turns ? 0 : k % 2 ? 1 : -1);
        this.line(last, next, stroke, 1.2);
        last = next;
      }
    }
  }

  drawCables(nodes, thick) {
    const now = indexAt(this.seriesT, clock.t);
    this.run.robot.cables.forEach((cable, index) => {
      const newton = this.tension[index] ? this.tension[index][now] : 0, stroke = tensionColour(newton / fullScale());
      const points = cable.nodes.map((rows, hole) => rows.reduce((p, row, k) => add(p, nodes[row], cable.weights[hole][k]), [0, 0, 0]));
      for (let k = 1; k < points.length; k++) this.line(points[k - 1], points[k], stroke, Math.max(1.3, 0.8 * thick));
    });
  }

  drawAxes(c, height) {
    const at = [40, height - 40];
    c.font = "12px system-ui, sans-serif"; c.lineWidth = 1.5;
    ["x", "y", "z"].forEach((name, k) => {
      const axis = [0, 1, 2].map((i) => (i === k ? 1 : 0)), x = at[0] + 26 * dot(axis, this.right), y = at[1] - 26 * dot(axis, this.up);
      c.strokeStyle = c.fillStyle = lineColour([1, 2, 0][k]);
      c.beginPath(); c.moveTo(...at); c.lineTo(x, y); c.stroke();
      c.fillText(name, x + 0.25 * (x - at[0]) - 3, y + 0.25 * (y - at[1]) + 4);
    });
  }

  listen() {
    const pointers = new Map();
    let apart = 0;
    this.canvas.addEventListener("pointerdown", (e) => { this.canvas.setPointerCapture(e.pointerId); pointers.set(e.pointerId, [e.clientX, e.clientY]); apart = 0; });
    for (const name of ["pointerup", "pointercancel"]) this.canvas.addEventListener(name, (e) => { pointers.delete(e.pointerId); apart = 0; });
    this.canvas.addEventListener("pointermove", (e) => {
      const before = pointers.get(e.pointerId);
      if (!before) return;
      const dx = e.clientX - before[0], dy = e.clientY - before[1];
      pointers.set(e.pointerId, [e.clientX, e.clientY]);
      if (pointers.size > 1) {
        const [p, q] = [...pointers.values()], distance = Math.hypot(p[0] - q[0], p[1] - q[1]);
        if (apart) this.zoom *= distance / apart;
        apart = distance;
      } else if (e.shiftKey) {
        this.target = add(add(this.target, this.right, -dx / this.pixels), this.up, dy / this.pixels);
      } else {
        this.azimuth -= 0.008 * dx;
        this.elevation = Math.min(1.57, Math.max(-1.57, this.elevation + 0.008 * dy));
      }
      this.draw();
    });
    this.canvas.addEventListener("keydown", (e) => {
      const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key], zoom = { "+": 1.15, "-": 1 / 1.15 }[e.key];
      if (turn) { this.azimuth += 0.12 * turn[0]; this.elevation = Math.min(1.57, Math.max(-1.57, this.elevation + 0.12 * turn[1])); }
      else if (zoom) this.zoom = Math.min(60, Math.max(0.3, this.zoom * zoom));
      else return;
      e.preventDefault(); e.stopPropagation(); this.draw();
    });
    this.canvas.addEventListener("wheel", (e) => { e.preventDefault(); this.zoom = Math.min(60, Math.max(0.3, this.zoom * Math.exp(-0.0015 * e.deltaY))); this.draw(); }, { passive: false });
  }
}
