// Asks the server for a frame, draws it, asks again: a page that is not seen asks for nothing.
import { begin, drawFilm, drawOrbit, drawSpectrum, drawTraces, Film3d, readings, shortcuts, Waterfall } from "rotorsim-live";

const LEAST = 40; // ms between two frames
const SLOW = 5; // frames between two readings of the numbers; maps and spectra take turns, orbits and traces always move

export default {
  props: { rig: Object },
  template: `<div class="live-stage">
    <div class="live-strip" role="group" aria-label="readings">
      <span v-for="r in readings" :key="r.name" :class="{ 'live-alarm': r.alarm }" :data-reading="r.name"><b>{{ r.name }}</b> {{ r.text }}</span>
    </div>
    <div class="live-views">
      <figure><figcaption>disc orbit, {{ rig.spans[0] }} s, about where it rests</figcaption><canvas ref="disc" role="img" aria-label="disc orbit"></canvas></figure>
      <figure v-if="rig.clearance"><figcaption>journal orbit, {{ rig.spans[0] }} s, in the bearing {{ bearing }}</figcaption><canvas ref="journal" role="img" aria-label="journal orbit"></canvas></figure>
      <figure v-if="rig.clearance"><figcaption>film on the journal {{ bearing }}, clearance exaggerated; drag to turn</figcaption>
        <div class="live-hold"><canvas ref="film3d" role="img" aria-label="film pressure in 3-D"></canvas></div></figure>
      <figure class="live-wide"><figcaption>what the sensors and actuators show</figcaption><canvas ref="traces" role="img" aria-label="time traces"></canvas></figure>
      <figure v-if="rig.clearance"><figcaption>film pressure {{ bearing }}, unrolled</figcaption><canvas ref="film" role="img" aria-label="film pressure, unrolled"></canvas></figure>
      <figure class="live-wide"><figcaption>spectrum of the disc, {{ rig.spans[1] }} s, the larger axis; point at it for order and size</figcaption>
        <canvas ref="spectrum" role="img" aria-label="spectrum" @mousemove="cursor = $event.offsetX" @mouseleave="cursor = null"></canvas></figure>
      <figure><figcaption>waterfall</figcaption><canvas ref="waterfall" role="img" aria-label="waterfall"></canvas></figure>
    </div></div>`,
  data: () => ({ cursor: null, readings: [], bearing: "" }),
  mounted() {
    this.alive = true;
    this.listening = shortcuts((key) => this.$emit("shortcut", key));
    this.fall = new Waterfall();
    this.frames = 0;
    this.loop();
  },
  unmounted() {
    this.alive = false;
    this.listening.abort();
    if (this.solid) this.solid.close();
  },
  methods: {
    async loop() {
      while (this.alive) {
        const began = performance.now();
        await new Promise((next) => requestAnimationFrame(next));
        const frame = await this.ask();
        if (frame && this.alive) {
          try {
            this.draw(frame);
          } catch (error) {
            console.error(error);
          }
          window.rotorsimFrames = ++this.frames;
        }
        const left = LEAST - (performance.now() - began);
        if (left > 0) await new Promise((next) => setTimeout(next, left));
      }
    },
    async ask() {
      try {
        const answer = await fetch("frame", { cache: "no-store" });
        if (answer.ok) return await answer.json();
      } catch { // the server has ended, or the page is left
      }
      await new Promise((next) => setTimeout(next, 500));
      return null;
    },
    draw(frame) {
      window.rotorsimFrame = frame;
      if (this.frames % SLOW === 0) {
        this.readings = readings(frame, this.rig);
        window.rotorsimRead = frame;
      }
      const r = this.$refs, rig = this.rig, film = frame.film;
      if (!frame.orbit) {
        for (const canvas of [r.disc, r.journal, r.traces, r.spectrum, r.waterfall]) if (canvas) begin(canvas);
        this.fall.clear();
        return;
      }
      const shown = { ...rig, ...rig.films[frame.shown] };
      this.bearing = rig.films.length > 1 && film ? shown.name : "";
      const safety = { radius: rig.safety, name: `safety ${rig.safety} um`, dash: [5, 4] };
      drawOrbit(r.disc, frame.orbit.disc, rig.safety ? [safety] : [], frame.centre);
      drawTraces(r.traces, frame.trace, rig.spans[2]);
      if (frame.spectrum) this.fall.add(frame.spectrum, frame.time);
      if (film) {
        const name = `clearance ${shown.clearance.toFixed(1)} um`;
        const room = { radius: Math.max(...shown.room), edge: shown.room, name, dash: [] };
        drawOrbit(r.journal, frame.orbit.journal, [room], [0, 0]);
      }
      if (this.frames % 2) {
        drawSpectrum(r.spectrum, frame, rig.highest, this.cursor);
        this.fall.draw(r.waterfall, rig.highest);
      } else if (film) {
        drawFilm(r.film, film, shown);
        this.drawSolid(film, frame, shown);
      }
    },
    drawSolid(film, frame, shown) {
      if (this.solid === undefined) {
        try {
          this.solid = new Film3d(this.$refs.film3d, shown);
        } catch {
          this.solid = null;
          this.$refs.film3d.replaceWith("This browser has no WebGL: the film cannot be shown in 3-D.");
        }
      }
      if (this.solid) {
        this.solid.rig = shown;
        const [x, y] = frame.orbit.journal;
        this.solid.draw(film, [x.at(-1), y.at(-1)], frame.now.angle);
      }
    },
  },
};
