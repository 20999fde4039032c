// What the task is about: walls, holes, objects, pipes, and what the end sees or sends out.
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, s) => [s * a[0], s * a[1], s * a[2]];
const unit = (a) => scaled(a, 1 / (Math.hypot(...a) || 1));
const triples = (text) => { const all = floats(text), found = []; for (let i = 0; i + 2 < all.length; i += 3) found.push([all[i], all[i + 1], all[i + 2]]); return found; };

// Every point that a picture of a task must hold.
const taskCorners = (task) => [...task.outlines.flatMap((o) => o.corners), ...task.balls.map((b) => b.centre)];
DATA.runs.forEach((run) => run.task.outlines.forEach((o) => { o.corners = triples(o.points); }));

// Draws onto c; project takes a point in space to the canvas, right is what is to the right there.
class TaskView {
  constructor(c, project, right) { Object.assign(this, { c, project, right }); }

  draw(task, t, end) {
    this.outlines(task);
    this.balls(task, t);
    if (end && task.sight) task.sight.half_angle ? this.camera(task.sight, end) : this.beam(task, end);
  }

  loop(points, stroke, width, fill) {
    const c = this.c;
    c.beginPath();
    points.forEach((p, i) => { const [x, y] = this.project(p); i ? c.lineTo(x, y) : c.moveTo(x, y); });
    c.closePath();
    if (fill) { c.save(); c.globalAlpha = fill; c.fillStyle = stroke; c.fill(); c.restore(); }
    c.strokeStyle = stroke; c.lineWidth = width; c.stroke();
  }

  label(text, at, dy = -6) {
    const c = this.c, [x, y] = this.project(at);
    c.font = "12px system-ui, sans-serif"; c.textAlign = "center"; c.textBaseline = "alphabetic";
    c.lineWidth = 3; c.lineJoin = "round"; c.strokeStyle = colour("panel"); c.strokeText(text, x, y + dy);
    c.fillStyle = colour("ink"); c.fillText(text, x, y + dy);
  }

  outlines(task) {
    const look = { wall: ["wall", 1, 0.05], hole: ["tip", 1.4, 0], pipe: ["wall", 1.2, 0.1], screen: ["view", 1, 0.1] };
    for (const o of task.outlines) this.loop(o.corners, colour(look[o.kind][0]), look[o.kind][1], look[o.kind][2]);
    for (const o of task.outlines) if (o.label) this.label(o.label, o.corners.reduce((a, b) => add(a, b, 1 / o.corners.length), [0, 0, 0]), -14);
  }

  balls(task, t) {
    const c = this.c;
    for (const ball of task.balls) {
      const [x, y] = this.project(ball.centre), [x1, y1] = this.project(add(ball.centre, this.right, ball.radius));
      const seen = ball.seen !== null && t >= ball.seen - 1e-9, size = Math.max(3, Math.hypot(x1 - x, y1 - y));
      c.beginPath(); c.arc(x, y, size, 0, 7);
      c.fillStyle = c.strokeStyle = colour(seen ? "good" : "quiet"); c.lineWidth = 1.5; c.stroke();
      if (seen) c.fill();
      this.label(ball.name + (seen ? " ✓" : ""), ball.centre, -size - 4);
    }
  }

  camera(sight, end) {
    const eye = add(end.at, end.normal, -sight.ahead), along = scaled(end.normal, -1);
    const side = unit(cross(along, Math.abs(along[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0])), other = cross(along, side);
    const middle = add(eye, along, sight.reach * Math.cos(sight.half_angle)), wide = sight.reach * Math.sin(sight.half_angle), rim = [];
    for (let k = 0; k < 32; k++) rim.push(add(add(middle, side, wide * Math.cos((k * Math.PI) / 16)), other, wide * Math.sin((k * Math.PI) / 16)));
    this.loop(rim, colour("view"), 1.2, 0.12);
    for (let k = 0; k < 32; k += 4) this.loop([eye, rim[k]], colour("view"), 0.7);
  }

  // The beam ends on the screen of a pipe that it goes through, else where it has gone far enough.
  beam(task, end) {
    const c = this.c, along = scaled(end.normal, -1);
    const off = (p, depth) => {
      const centre = add(p.entry, p.axis, depth), distance = dot(add(centre, end.at, -1), p.axis) / dot(along, p.axis), hit = add(end.at, along, distance);
      return [Math.hypot(...add(hit, centre, -1)), hit];
    };
    const through = task.passages.find((p) => dot(along, p.axis) > 0 && dot(add(end.at, p.entry, -1), p.axis) <= 0 && Math.max(off(p, 0)[0], off(p, p.length)[0]) < p.radius);
    const last = through ? off(through, through.length + through.screen)[1] : add(end.at, along, task.sight.reach);
    c.setLineDash(through ? [] : [4, 4]);
    this.loop([end.at, last], colour("beam"), through ? 2 : 1.2);
    c.setLineDash([]);
    if (!through) return;
    const [x, y] = this.project(last);
    c.fillStyle = colour("beam"); c.beginPath(); c.arc(x, y, 4.5, 0, 7); c.fill();
  }
}
