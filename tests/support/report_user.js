// What a user does with the page of a run; what comes of it is left as JSON on the root element.
const said = {};
const note = (name, value) => {
  said[name] = value;
  document.documentElement.dataset.said = JSON.stringify(said);
};
const picture = () => document.querySelector(".robot").toDataURL();
slider.value = 1.5; slider.dispatchEvent(new Event("input")); note("slider", clock.t);
const plot = document.querySelector(".plot"), box = plot.getBoundingClientRect();
const at = (share) => ({ clientX: box.left + 52 + share * (box.width - 60), clientY: box.top + 50, bubbles: true, button: 0, pointerId: 1 });
plot.setPointerCapture = () => {};
plot.dispatchEvent(new PointerEvent("pointermove", at(0.5))); note("hover", clock.t);
plot.dispatchEvent(new PointerEvent("pointerdown", at(0.25)));
plot.dispatchEvent(new PointerEvent("pointermove", at(0.75)));
plot.dispatchEvent(new PointerEvent("pointerup", at(0.75))); note("zoomed", [span.from, span.to]);
plot.dispatchEvent(new MouseEvent("dblclick", at(0.5))); note("whole", [span.from, span.to]);
const before = picture();
document.querySelector("[data-view=above]").click(); const above = picture(); note("turned", above !== before);
robotViews[0].canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -300 })); note("closer", picture() !== above);
clock.set(0); robotViews[0].draw(); const first = picture();
clock.set(2); robotViews[0].draw(); note("moved", picture() !== first);
document.getElementById("theme").click(); note("theme", document.documentElement.dataset.theme);
document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "End", bubbles: true })); note("end", clock.t);
// Frames of the screen come when this script says so, not as fast as the computer can.
// The keyboard alone: the picture turns, time zooms, an event is followed.
robotViews[0].draw(); const still = picture();
robotViews[0].canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft", bubbles: true })); note("turnedByKey", picture() !== still);
document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "+", bubbles: true })); note("zoomedByKey", span.to - span.from);
document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "0", bubbles: true }));
document.querySelector('.details a[href="#t=0.500"]').click(); note("event", clock.t);
clock.set(DATA.end);
const frames = [];
window.requestAnimationFrame = (frame) => frames.push(frame);
document.body.dispatchEvent(new KeyboardEvent("keydown", { key: " ", bubbles: true })); note("playing", player.playing);
note("began", clock.t);
frames.splice(0).forEach((frame) => frame(player.last + 500)); note("played", clock.t);
