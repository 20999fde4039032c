// Curves over time; all of them share the span that is shown and the clock.
const span = { from: DATA.begin, to: Math.max(DATA.end, DATA.begin + 1e-6) };
const LEFT = 52, RIGHT = 8, TOP = 6, BOTTOM = 18;

class Chart {
  constructor(parent, chart, onSpan) {
    this.chart = chart;
    this.lines = chart.lines.map((line) => floats(line.values));
    this.times = chart.lines.map((line) => seriesTimes[line.run]);
    this.marks = chart.lines.map((line) => line.marks && unpack(line.marks, Uint8Array));
    const element = parent.appendChild(document.createElement("div"));
    element.className = "chart";
    this.head = element.appendChild(document.createElement("header"));
    this.plot = element.appendChild(document.createElement("div"));
    this.plot.className = "plot";
    this.below = this.plot.appendChild(document.createElement("canvas"));
    this.above = this.plot.appendChild(document.createElement("canvas"));
    this.makeLegend();
    this.listen(onSpan);
  }

  // "wanted" is a dashed line in the colour of the text, or of its run if runs wanted different things.
  look(i) {
    const { wanted, look, name } = this.chart.lines[i];
    if (wanted) return [name === "wanted" ? colour("ink") : lineColour(look), [3, 3]];
    return [lineColour(look), DASHES[look % 4]];
  }

  makeLegend() {
    const { name, unit, lines } = this.chart;
    this.head.replaceChildren(document.createElement("b"));
    this.head.firstChild.textContent = `${name} [${unit}]`;
    this.values = lines.map((line, i) => {
      const [stroke, dash] = this.look(i), item = this.head.appendChild(document.createElement("span"));
      item.innerHTML = `<svg width="22" height="6"><line x1="0" y1="3" x2="22" y2="3" stroke="${stroke}" stroke-width="2" stroke-dasharray="${dash}"/></svg>`;
      item.append(line.name + " ");
      return item.appendChild(document.createElement("b"));
    });
  }

  range() {
    let low = Infinity, high = -Infinity;
    this.lines.forEach((line, k) => {
      const first = indexAt(this.times[k], span.from), last = indexAt(this.times[k], span.to);
      for (let i = first; i <= last; i++) if (isFinite(line[i])) { low = Math.min(low, line[i]); high = Math.max(high, line[i]); }
    });
    if (!isFinite(low)) [low, high] = [0, 1];
    const reach = Math.max(0.35 * (high - low), 0.1 * Math.max(Math.abs(low), Math.abs(high)));
    this.near = this.chart.limits.filter((limit) => limit.at >= low - reach && limit.at <= high + reach);
    for (const limit of this.near) { low = Math.min(low, limit.at); high = Math.max(high, limit.at); }
    if (this.chart.from_zero) low = 0;
    const room = 0.06 * (high - low) || 0.06 * Math.abs(high) || 1;
    return [this.chart.from_zero ? 0 : low - room, high + room];
  }

  draw() {
    const [c, width, height] = sharp(this.below);
    if (!width) return;
    const [low, high] = this.range();
    this.x = (t) => LEFT + ((t - span.from) / (span.to - span.from)) * (width - LEFT - RIGHT);
    this.y = (v) => height - BOTTOM - ((v - low) / (high - low)) * (height - TOP - BOTTOM);
    this.width = width; this.height = height;
    this.digits = Math.min(4, Math.max(0, 4 - Math.floor(Math.log10(high - low))));
    this.drawGrid(c, low, high);
    c.save(); c.beginPath(); c.rect(LEFT, TOP - 2, width - LEFT - RIGHT, height - TOP - BOTTOM + 4); c.clip();
    this.drawSpans(c);
    this.drawLimits(c);
    this.lines.forEach((line, i) => this.drawLine(c, line, i));
    c.restore();
    this.drawCursor();
  }

  drawGrid(c, low, high) {
    const quiet = colour("quiet"), grid = colour("grid");
    c.font = "11px system-ui, sans-serif"; c.lineWidth = 1; c.fillStyle = quiet; c.strokeStyle = grid;
    c.textAlign = "right"; c.textBaseline = "middle";
    const [rows, digits] = ticks(low, high, 4), [columns, decimals] = ticks(span.from, span.to, Math.max(3, this.width / 90));
    for (const v of rows) { const y = this.y(v); c.beginPath(); c.moveTo(LEFT, y); c.lineTo(this.width - RIGHT, y); c.stroke(); c.fillText(fixed(v, digits), LEFT - 6, y, LEFT - 7); }
    c.textAlign = "center"; c.textBaseline = "top";
    for (const t of columns) { const x = this.x(t); c.beginPath(); c.moveTo(x, TOP); c.lineTo(x, this.height - BOTTOM); c.stroke(); c.fillText(t.toFixed(decimals) + " s", Math.min(x, this.width - 16), this.height - BOTTOM + 4); }
  }

  // Where the quantity is not defined.
  drawSpans(c) {
    c.font = "11px system-ui, sans-serif"; c.textAlign = "left"; c.textBaseline = "top";
    for (const [from, to] of this.chart.spans) {
      const x = this.x(from), wide = Math.max(2, this.x(to) - x);
      c.fillStyle = colour("band"); c.globalAlpha = 0.45; c.fillRect(x, TOP, wide, this.height - TOP - BOTTOM); c.globalAlpha = 1;
      if (wide > 150) { c.fillStyle = colour("quiet"); c.fillText("not defined: the end looks along x", x + 6, TOP + 3); }
    }
  }

  drawLimits(c) {
    c.strokeStyle = c.fillStyle = colour("quiet"); c.setLineDash([8, 4]); c.textAlign = "right"; c.textBaseline = "bottom";
    for (const limit of this.near) {
      const y = this.y(limit.at);
      c.beginPath(); c.moveTo(LEFT, y); c.lineTo(this.width - RIGHT, y); c.stroke();
      c.fillText(`${limit.name} ${+limit.at.toPrecision(6)}`, this.width - RIGHT - 4, y < TOP + 14 ? y + 13 : y - 1);
    }
    c.setLineDash([]);
  }

  drawLine(c, line, i) {
    const [stroke, dash] = this.look(i), t = this.times[i], last = Math.min(t.length - 1, indexAt(t, span.to) + 1);
    c.strokeStyle = stroke; c.lineWidth = 1.4; c.setLineDash(dash); c.lineJoin = "round";
    c.beginPath();
    let pen = false;
    for (let k = indexAt(t, span.from); k <= last; k++) {
      if (!isFinite(line[k])) { pen = false; continue; }
      if (pen) c.lineTo(this.x(t[k]), this.y(line[k])); else c.moveTo(this.x(t[k]), this.y(line[k]));
      pen = true;
    }
    c.stroke(); c.setLineDash([]);
    if (!this.marks[i]) return;
    c.strokeStyle = colour("ink"); c.lineWidth = 1; c.beginPath();
    for (let k = 0; k < line.length; k++) if (this.marks[i][k]) {
      const x = this.x(t[k]), y = this.y(line[k]);
      c.moveTo(x - 2.5, y - 2.5); c.lineTo(x + 2.5, y + 2.5); c.moveTo(x - 2.5, y + 2.5); c.lineTo(x + 2.5, y - 2.5);
    }
    c.stroke();
  }

  drawCursor() {
    const [c] = sharp(this.above), x = this.x(clock.t), at = this.times.map((t) => indexAt(t, clock.t));
    this.lines.forEach((line, i) => { const now = at[i]; this.values[i].textContent = isFinite(line[now]) ? fixed(line[now], this.digits) : "–"; });
    if (this.drag) {
      c.fillStyle = colour("accent"); c.globalAlpha = 0.18;
      c.fillRect(Math.min(...this.drag), TOP, Math.abs(this.drag[1] - this.drag[0]), this.height - TOP - BOTTOM);
      c.globalAlpha = 1;
    }
    if (x < LEFT - 1 || x > this.width - RIGHT + 1) return;
    c.strokeStyle = colour("ink"); c.lineWidth = 1; c.globalAlpha = 0.7;
    c.beginPath(); c.moveTo(x, TOP); c.lineTo(x, this.height - BOTTOM); c.stroke();
    c.globalAlpha = 1;
    this.lines.forEach((line, i) => {
      const now = at[i];
      if (!isFinite(line[now])) return;
      c.fillStyle = this.look(i)[0];
      c.beginPath(); c.arc(x, this.y(line[now]), 2.8, 0, 7); c.fill();
    });
  }

  timeAt(x) { return span.from + ((x - LEFT) / (this.width - LEFT - RIGHT)) * (span.to - span.from); }

  listen(onSpan) {
    const at = (e) => Math.min(this.width - RIGHT, Math.max(LEFT, e.clientX - this.plot.getBoundingClientRect().left));
    this.plot.addEventListener("pointerdown", (e) => { if (e.button === 0) { this.plot.setPointerCapture(e.pointerId); this.drag = [at(e), at(e)]; } });
    this.plot.addEventListener("pointermove", (e) => { if (this.drag) this.drag[1] = at(e); if (this.drag || !player.playing) clock.set(this.timeAt(at(e))); });
    this.plot.addEventListener("pointercancel", () => { this.drag = null; this.drawCursor(); });
    this.plot.addEventListener("pointerup", (e) => {
      if (!this.drag) return;
      const [a, b] = [...this.drag].sort((p, q) => p - q);
      this.drag = null;
      if (b - a > 6) onSpan(this.timeAt(a), this.timeAt(b)); else clock.set(this.timeAt(at(e)));
    });
    this.plot.addEventListener("dblclick", () => onSpan(DATA.begin, DATA.end));
  }
}
