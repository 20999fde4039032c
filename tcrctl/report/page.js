// Player, theme, and everything joined together.
const element = (id) => document.getElementById(id);
const player = { playing: false, speed: 1, last: 0 };
let robotViews = [];
const fullScale = () => Math.max(...robotViews.map((view) => view.most || 0)) || 1;
// Robot and player are in view however much stands above them.
const measure = () => document.documentElement.style.setProperty("--above", `${element("run").offsetTop}px`);
measure();
document.querySelectorAll("canvas.robot").forEach((canvas) => robotViews.push(new RobotView(canvas)));
const plan = new PlanView(element("plan"));
const charts = DATA.charts.map((chart) => new Chart(element("charts"), chart, show));

function show(from, to) {
  span.from = from; span.to = Math.max(to, from + 1e-6);
  charts.forEach((c) => c.draw());
}

function drawStage() {
  robotViews.forEach((view) => view.draw());
  plan.draw();
}

function redraw() {
  drawStage();
  charts.forEach((chart) => { chart.makeLegend(); chart.draw(); });
  element("plan-name").textContent = `path of the end, ${DATA.plane.name}`;
  document.querySelectorAll("i.run").forEach((dot) => { dot.style.background = lineColour(+dot.dataset.run); });
  const bar = element("scale");
  bar.textContent = "";
  if (DATA.runs.some((run) => run.robot && run.robot.cables.length)) {
    bar.append("tension 0");
    bar.appendChild(document.createElement("i")).style.background = `linear-gradient(90deg, ${[0, 0.25, 0.5, 0.75, 1].map(tensionColour).join()})`;
    bar.append(`${fullScale().toPrecision(3)} N`);
  }
}

function look(view) {
  robotViews.forEach((robot) => robot.look(view));
  document.querySelectorAll("[data-view]").forEach((button) => button.setAttribute("aria-pressed", String(button.dataset.view === view)));
}

function play(on) {
  if (on && clock.t >= DATA.end) clock.set(DATA.begin);
  player.playing = on; player.last = performance.now();
  element("play").textContent = on ? "❚❚" : "▶";
  if (on) requestAnimationFrame(advance);
}

function advance(now) {
  if (!player.playing) return;
  clock.set(clock.t + (player.speed * Math.max(0, now - player.last)) / 1000);
  player.last = now;
  if (clock.t >= DATA.end) play(false); else requestAnimationFrame(advance);
}

// Many pointer events may come between two frames of the screen; only the last one is drawn.
let due = false;
clock.listeners.push(() => {
  if (due) return;
  due = true;
  requestAnimationFrame(() => {
    due = false;
    element("time").value = clock.t;
    element("clock").textContent = clock.t.toFixed(2) + " s";
    drawStage();
    charts.forEach((chart) => chart.drawCursor());
  });
});

// Marks under the slider; the same links stand in the list of events, where the keyboard reaches them.
for (const event of DATA.runs.flatMap((run) => run.events)) {
  const mark = element("marks").appendChild(document.createElement("a"));
  mark.className = event.level; mark.title = `${event.t.toFixed(2)} s: ${event.said}`;
  mark.style.left = `${(100 * (event.t - DATA.begin)) / (DATA.end - DATA.begin || 1)}%`;
  mark.addEventListener("click", () => { play(false); clock.set(event.t); });
}

// A link may point at an instant: report.html#t=12.5
const asked = (hash) => /t=([0-9.]+)/.exec(hash);
function goTo(hash) {
  const found = asked(hash);
  if (!found) return;
  play(false); clock.set(+found[1]);
  const { top, bottom } = element("run").getBoundingClientRect();
  if (bottom < 200 || top > innerHeight - 200) element("run").scrollIntoView();
}
document.querySelectorAll('a[href^="#t="]').forEach((link) => link.addEventListener("click", () => goTo(link.hash)));
window.addEventListener("hashchange", () => goTo(location.hash));

const slider = element("time");
slider.min = DATA.begin; slider.max = DATA.end;
slider.addEventListener("input", () => clock.set(+slider.value));
element("play").addEventListener("click", () => play(!player.playing));
element("speed").addEventListener("change", (e) => { player.speed = +e.target.value; });
document.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => look(button.dataset.view)));
element("theme").addEventListener("click", () => { document.documentElement.dataset.theme = isDark() ? "light" : "dark"; redraw(); });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
window.addEventListener("resize", () => { measure(); robotViews.forEach((view) => view.fit()); redraw(); });
window.addEventListener("keydown", (e) => {
  if (e.target.matches("input, select, button, summary, a") && e.key !== " ") return;
  const step = Math.max(0.05, (DATA.end - DATA.begin) / 1000), wide = span.to - span.from;
  const jump = { ArrowLeft: clock.t - step, ArrowRight: clock.t + step, Home: DATA.begin, End: DATA.end }[e.key];
  const zoom = { "+": 0.5, "-": 2 }[e.key];
  if (jump !== undefined) { clock.set(jump); e.preventDefault(); }
  else if (e.key === " " && !e.target.matches("button, select, summary, a")) { play(!player.playing); e.preventDefault(); }
  else if (zoom) show(Math.max(DATA.begin, clock.t - (zoom * wide) / 2), Math.min(DATA.end, clock.t + (zoom * wide) / 2));
  else if (e.key === "0") show(DATA.begin, DATA.end);
});
const wanted = asked(location.hash);
clock.t = Math.min(DATA.end, Math.max(DATA.begin, wanted ? +wanted[1] : DATA.open));
look("space");
redraw();
clock.set(clock.t);
document.documentElement.dataset.ready = "true";
