// The path of the end as a drawing, seen across its plane: all of what was wanted, and what was reached.
class PlanView {
  constructor(canvas) {
    this.canvas = canvas;
    const { right, up } = DATA.plane, flat = (p) => [dot(p, right), dot(p, up)];
    this.out = cross(right, up);
    this.runs = DATA.runs.map((run) => ({
      t: floats(run.path.t), actual: triples(run.path.actual), wanted: triples(run.path.wanted), drawn: unpack(run.path.drawn, Uint8Array), task: run.task,
    }));
    this.shared = DATA.shared_reference;
    const points = this.runs.flatMap((run) => [...run.actual, ...run.wanted, ...taskCorners(run.task)]).filter((p) => p.every(isFinite)).map(flat);
    const low = [0, 1].map((k) => points.reduce((m, p) => Math.min(m, p[k]), Infinity)), high = [0, 1].map((k) => points.reduce((m, p) => Math.max(m, p[k]), -Infinity));
    this.middle = [0, 1].map((k) => (low[k] + high[k]) / 2);
    this.size = [0, 1].map((k) => Math.max(high[k] - low[k], 0.004));
    this.flat = flat;
  }

  draw() {
    const [c, width, height] = sharp(this.canvas);
    if (!width) return;
    const left = 46, below = 34, above = 26, side = 14, pixels = Math.min((width - left - side) / this.size[0], (height - below - above) / this.size[1]) * 0.94;
    const x0 = left + (width - left - side) / 2, y0 = above + (height - above - below) / 2;
    this.project = (p) => { const [a, b] = this.flat(p); return [x0 + pixels * (a - this.middle[0]), y0 - pixels * (b - this.middle[1])]; };
    this.frame = { left, right: width - side, top: above, bottom: height - below };
    this.drawGrid(c, pixels, x0, y0);
    c.save(); c.beginPath(); c.rect(left, above, width - side - left, height - below - above); c.clip();
    this.runs.forEach((run, i) => { if (this.shared === null || this.shared === i) this.drawWanted(c, run, i); });
    const view = new TaskView(c, this.project, DATA.plane.right);
    view.draw(this.runs[0].task, clock.t, robotViews[0].end);
    this.runs.forEach((run, i) => this.drawActual(c, run, i));
    c.restore();
  }

  drawGrid(c, pixels, x0, y0) {
    const { left, right, top, bottom } = this.frame, at = (v, k) => (k ? y0 - pixels * (v / 1e3 - this.middle[1]) : x0 + pixels * (v / 1e3 - this.middle[0]));
    c.font = "11px system-ui, sans-serif"; c.lineWidth = 1; c.strokeStyle = colour("grid"); c.fillStyle = colour("quiet");
    const span = (k) => { const reach = (k ? bottom - top : right - left) / pixels / 2; return [1e3 * (this.middle[k] - reach), 1e3 * (this.middle[k] + reach)]; };
    for (const k of [0, 1]) {
      const [values, digits] = ticks(...span(k), Math.max(2, (k ? bottom - top : right - left) / 75));
      c.textAlign = k ? "right" : "center"; c.textBaseline = k ? "middle" : "top";
      for (const v of values) {
        const p = at(v, k);
        c.beginPath(); k ? (c.moveTo(left, p), c.lineTo(right, p)) : (c.moveTo(p, top), c.lineTo(p, bottom)); c.stroke();
        const text = fixed(v, digits);
        k ? c.fillText(text, left - 5, p) : c.fillText(text, p, bottom + 4);
      }
    }
    const [across, up] = DATA.plane.labels;
    c.textAlign = "right"; c.textBaseline = "bottom"; c.fillText(`${across} [mm]`, right, bottom + 32);
    c.textAlign = "left"; c.fillText(`${up} [mm]`, 4, top - 2);
  }

  // Runs of a path that are drawing, or are not.
  trace(c, run, points, down, until) {
    c.beginPath();
    for (let i = 1; i < until; i++) {
      if ((run.drawn[i] && run.drawn[i - 1] ? 1 : 0) !== down || !points[i].every(isFinite) || !points[i - 1].every(isFinite)) continue;
      c.moveTo(...this.project(points[i - 1])); c.lineTo(...this.project(points[i]));
    }
    c.stroke();
  }

  drawWanted(c, run, i) {
    const n = run.t.length;
    c.lineCap = "round";
    const common = this.shared !== null;
    c.strokeStyle = common ? colour("band") : lineColour(i); c.globalAlpha = common ? 1 : 0.25;
    c.lineWidth = 6; this.trace(c, run, run.wanted, 1, n);
    c.globalAlpha = 1; c.strokeStyle = colour("quiet"); c.lineWidth = 1; c.setLineDash([2, 3]);
    this.trace(c, run, run.wanted, 0, n);
    c.setLineDash([]); c.lineCap = "butt";
  }

  drawActual(c, run, i) {
    const now = indexAt(run.t, clock.t), n = run.t.length;
    c.strokeStyle = lineColour(i);
    for (const [until, alpha] of [[n, 0.35], [now + 1, 1]]) {
      c.globalAlpha = alpha; c.lineWidth = 1.8; this.trace(c, run, run.actual, 1, until);
      c.lineWidth = 0.8; this.trace(c, run, run.actual, 0, until);
    }
    c.globalAlpha = 1;
    if (run.wanted[now].every(isFinite)) cross2d(c, ...this.project(run.wanted[now]));
    if (!run.actual[now].every(isFinite)) return;
    c.fillStyle = lineColour(i); c.beginPath(); c.arc(...this.project(run.actual[now]), 4, 0, 7); c.fill();
    c.strokeStyle = colour("panel"); c.lineWidth = 1.5; c.stroke();
  }
}

// Where the end is wanted.
function cross2d(c, x, y) {
  c.strokeStyle = colour("ink"); c.lineWidth = 1.3;
  c.beginPath(); c.moveTo(x - 8, y); c.lineTo(x + 8, y); c.moveTo(x, y - 8); c.lineTo(x, y + 8); c.stroke();
}
