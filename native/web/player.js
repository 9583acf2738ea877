// SPDX-License-Identifier: MIT
// Plays a clip on the face with its sound.

export class Player {
  /** In: the bar with #play, #time and #clock; shown([[control, value]], [[joint, quaternion]]). */
  constructor(root, shown) {
    this.root = root;
    this.shown = shown;
    this.clip = this.audio = null;
    this.time = this.length = 0;
    this.playing = false;
    this.button = root.querySelector("#play");
    this.slider = root.querySelector("#time");
    this.clock = root.querySelector("#clock");
    this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.slider.addEventListener("input", () => {
      this.pause();
      this.seek(this.slider.valueAsNumber);
    });
  }

  /** In: clip {rate, frames, controls: [index], turns: [joint]}; values float32[frames, controls + 4 * turns]; sound: {url, offset} or null. */
  load(clip, values, sound) {
    this.pause();
    Object.assign(this, { clip, values });
    this.listen(sound);
    this.length = Math.max(clip.frames - 1, 1) / clip.rate;
    this.slider.max = this.length;
    this.slider.step = "any";
    this.root.hidden = false;
    this.seek(0);
  }
  listen(sound) {
    this.audio = sound ? new Audio(sound.url) : null;
    this.offset = sound?.offset ?? 0;
    this.isMute = false;
  }

  play() {
    if (!this.clip) return;
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

  /** The current second of the clip. While the sound plays, it is the clock. */
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
      audio.play().catch(() => (this.isMute = true)); // the browser may refuse sound; the face plays on
    }
    return time;
  }

  /** Called once per picture. */
  step() {
    if (!this.playing) return;
    const time = this.now();
    this.seek(Math.min(time, this.length));
    if (time < this.length) return;
    this.pause();
    this.play(); // loop
  }

  /** Interpolates between two frames. */
  seek(time) {
    if (!this.clip) return;
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
