// The slider, the sound and the robot's place move together. Without scripts the page shows the first moment.
const walk = JSON.parse(document.getElementById("walk").textContent);
const slider = document.getElementById("moment");
const clock = document.getElementById("clock");
const sound = document.getElementById("track");
const robot = document.getElementById("robot");
const needle = document.getElementById("needle");
const frames = document.querySelectorAll(".frame");

function nearest(times, seconds) {
  let best = 0;
  for (let i = 1; i < times.length; i++) {
    if (Math.abs(times[i] - seconds) < Math.abs(times[best] - seconds)) best = i;
  }
  return best;
}

function show(seconds) {
  const moment = nearest(walk.moments, seconds);
  const share = walk.moments.length > 1 ? (100 * moment) / (walk.moments.length - 1) : 0;
  frames.forEach((frame) => { frame.style.backgroundPosition = `${share}% 0`; });
  const place = nearest(walk.stamps, seconds);
  robot.setAttribute("cx", walk.x[place]);
  robot.setAttribute("cy", walk.y[place]);
  needle.setAttribute("x1", (1000 * seconds) / walk.duration);
  needle.setAttribute("x2", (1000 * seconds) / walk.duration);
  clock.textContent = `${seconds.toFixed(0)} s`;
}

slider.addEventListener("input", () => {
  if (sound && sound.paused) sound.currentTime = Number(slider.value);
  show(Number(slider.value));
});
if (sound) {
  sound.addEventListener("timeupdate", () => { slider.value = sound.currentTime; show(sound.currentTime); });
}
document.querySelectorAll("button[data-at]").forEach((button) => {
  button.addEventListener("click", () => {
    const seconds = Number(button.dataset.at);
    slider.value = seconds;
    show(seconds);
    if (sound) { sound.currentTime = Math.max(seconds - 0.5, 0); sound.play().catch(() => {}); }
  });
});
show(Number(slider.value));
