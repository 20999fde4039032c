// Player, theme, and everything joined together.
const element = (id) => document.getElementById(id);
const player = { playing: false, speed: 1, last: 0 };
const robotView = new RobotView(element("robot"));
const charts = DATA.charts.map((chart) => new Chart(element("charts"), chart, (from, to) => {
  span.from = from; span.to = Math.max(to, from + 1e-6);
  charts.forEach((c) => c.draw());
}));

function redraw() {
  robotView.draw();
  charts.forEach((chart) => { chart.makeLegend(); chart.draw(); });
  const bar = element("scale");
  bar.textContent = "";
  if (DATA.robot && DATA.robot.cables.length) {
    bar.append(`cable tension 0 … ${robotView.fullScale.toPrecision(3)} N`);
    bar.appendChild(document.createElement("i")).style.background = `linear-gradient(90deg, ${[0, 0.25, 0.5, 0.75, 1].map(tensionColour).join()})`;
  }
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
    robotView.draw();
    charts.forEach((chart) => chart.drawCursor());
  });
});

const slider = element("time");
slider.min = DATA.begin; slider.max = DATA.end;
slider.addEventListener("input", () => clock.set(+slider.value));
element("play").addEventListener("click", () => play(!player.playing));
element("speed").addEventListener("change", (e) => { player.speed = +e.target.value; });
document.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => robotView.look(button.dataset.view)));
element("theme").addEventListener("click", () => { document.documentElement.dataset.theme = isDark() ? "light" : "dark"; redraw(); });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
window.addEventListener("resize", () => { robotView.fit(); redraw(); });
window.addEventListener("keydown", (e) => {
  if (e.target.matches("input, select, button, summary") && e.key !== " ") return;
  const step = Math.max(0.05, (DATA.end - DATA.begin) / 1000);
  const jump = { ArrowLeft: clock.t - step, ArrowRight: clock.t + step, Home: DATA.begin, End: DATA.end }[e.key];
  if (jump !== undefined) { clock.set(jump); e.preventDefault(); }
  else if (e.key === " " && !e.target.matches("button, select, summary")) { play(!player.playing); e.preventDefault(); }
});
// A link may point at an instant: report.html#t=12.5
const wanted = /t=([0-9.]+)/.exec(location.hash);
redraw();
clock.set(wanted ? +wanted[1] : DATA.begin + 0.35 * (DATA.end - DATA.begin));
document.documentElement.dataset.ready = "true";
