// SPDX-License-Identifier: MIT
// A clip on the face, with its sound.

export class Player {
  /** In: clip {rate, frames, controls: [index], turns: [joint]}; values float32[frames, controls + 4 * turns]; sound: {url, offset} or null. */
  constructor(root, clip, values, sound, shown) {
    this.clip = clip;
    this.values = values;
    this.shown = shown;
    this.time = 0;
    this.playing = false;
    this.audio = sound ? new Audio(sound.url) : null;
    this.offset = sound?.offset ?? 0;
    this.length = Math.max(clip.frames - 1, 1) / clip.rate;
    this.button = root.querySelector("#play");
    this.slider = root.querySelector("#time");
    this.clock = root.querySelector("#clock");
    this.slider.max = this.length;
    this.slider.step = "any";
    root.hidden = false;
    this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.slider.addEventListener("input", () => {
      this.pause();
      this.seek(this.slider.valueAsNumber);
    });
    addEventListener("keydown", (event) => {
      if (event.code !== "Space" || event.target.closest("input[type=search], button")) return;
      event.preventDefault();
      this.button.click();
    });
    this.seek(0);
  }

  play() {
    if (this.time >= this.length) this.time = 0;
    this.playing = true;
    this.began = performance.now() / 1000 - this.time;
    this.label();
  }
  pause() {
    this.playing = false;
    this.audio?.pause();
    this.label();
  }
  label() {
    this.button.textContent = this.playing ? "❚❚" : "▶";
    this.button.setAttribute("aria-label", this.playing ? "Pause" : "Play");
  }

  /** The second of the clip that is heard or shown now. The sound has the clock while it plays. */
  now() {
    const { audio } = this;
    const time = performance.now() / 1000 - this.began;
    if (!audio) return time;
    const at = time - this.offset;
    if (!audio.paused) {
      this.began += at - audio.currentTime;
      return audio.currentTime + this.offset;
    }
    if (at >= 0 && at < (audio.duration || 0) && !this.isMute) {
      audio.currentTime = at;
      audio.play().catch(() => (this.isMute = true)); // a browser may refuse; the face goes on
    }
    return time;
  }

  /** Called for every picture. */
  step() {
    if (!this.playing) return;
    const time = this.now();
    this.seek(Math.min(time, this.length));
    if (time < this.length) return;
    this.pause();
    this.play(); // round and round
  }

  /** Between two frames values are mixed. */
  seek(time) {
    this.time = time;
    this.slider.value = time;
    this.slider.style.setProperty("--part", `${(100 * time) / this.length}%`);
    this.clock.textContent = `${time.toFixed(1)} / ${this.length.toFixed(1)} s`;
    const at = Math.min(time * this.clip.rate, this.clip.frames - 1);
    const first = Math.floor(at);
    const second = Math.min(first + 1, this.clip.frames - 1);
    const count = this.clip.controls.length;
    const width = count + 4 * this.clip.turns.length;
    const share = at - first;
    const value = (i) =>
      (1 - share) * this.values[first * width + i] + share * this.values[second * width + i];
    this.shown(
      this.clip.controls.map((control, i) => [control, value(i)]),
      this.clip.turns.map((joint, i) => [joint, [0, 1, 2, 3].map((part) => value(count + 4 * i + part))]),
    );
  }
}
