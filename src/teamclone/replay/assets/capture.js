// Pictures and clips of the pitch, with a line that says which moment they are of.

import { colours, FONT } from "./theme.js";

const LONGEST_S = 30;
const CLIP_RATE = 30;
// How long a slow encoder may take to give its first picture, and how often it is asked.
const PATIENCE_MS = 20_000;
const ASK_MS = 100;
const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];

export class Capture {
  constructor(pitch, match, clock, onChange) {
    Object.assign(this, { pitch, match, clock, onChange });
    this.recorder = null;
  }

  get recording() {
    return this.recorder !== null;
  }

  /** The pitch with its caption, in a canvas of its own. */
  compose() {
    this.canvas ??= document.createElement("canvas");
    const { width, height } = this.pitch;
    const band = Math.round(Math.max(28, width * 0.03));
    // An even size: encoders want it.
    const size = [width - (width % 2), height + band - ((height + band) % 2)];
    if (this.canvas.width !== size[0] || this.canvas.height !== size[1]) [this.canvas.width, this.canvas.height] = size;
    const context = this.canvas.getContext("2d");
    context.fillStyle = colours.paper;
    context.fillRect(0, 0, ...size);
    context.drawImage(this.pitch, 0, band);
    const { match } = this;
    const frame = this.clock.frame;
    const [left, right] = match.score(frame);
    context.font = `600 ${Math.round(band * 0.55)}px ${FONT}`;
    context.textBaseline = "middle";
    context.fillStyle = colours.ink;
    context.fillText(`${match.teamName(0)} ${left} : ${right} ${match.teamName(1)}`, band / 3, band / 2, width * 0.62);
    context.textAlign = "right";
    context.fillStyle = colours.muted;
    context.fillText(`${match.mode(frame)}, cycle ${match.cycle(frame)}`, width - band / 3, band / 2, width * 0.34);
    context.textAlign = "left";
    return this.canvas;
  }

  name(ending) {
    return `replay-${this.match.head.match}-c${this.match.cycle(this.clock.frame)}.${ending}`;
  }

  async png() {
    const blob = await new Promise((done) => this.compose().toBlob(done, "image/png"));
    save(blob, this.name("png"));
    return blob;
  }

  /** Begin a clip, or end it. */
  clip() {
    if (this.recorder) {
      this.finish();
      return;
    }
    const type = TYPES.find((one) => globalThis.MediaRecorder?.isTypeSupported(one));
    if (!type) {
      this.onChange("This browser records no video.");
      return;
    }
    const stream = this.compose().captureStream(CLIP_RATE);
    const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: 6_000_000 });
    const parts = (this.parts = []);
    const name = this.name(type.startsWith("video/mp4") ? "mp4" : "webm");
    recorder.addEventListener("dataavailable", (event) => {
      if (event.data.size) parts.push(event.data);
    });
    recorder.addEventListener("stop", () => {
      clearTimeout(this.limit);
      for (const track of stream.getTracks()) track.stop();
      this.recorder = null;
      if (!parts.length) {
        this.onChange("The browser recorded no picture: nothing is saved.");
        return;
      }
      this.lastClip = new Blob(parts, { type: type.split(";")[0] });
      save(this.lastClip, name);
      this.onChange("The clip is saved.");
    });
    recorder.start(1000);
    this.recorder = recorder;
    this.limit = setTimeout(() => this.finish(), LONGEST_S * 1000);
    this.onChange("Recording.");
  }

  /** End the clip as soon as it has a picture: what is stopped before the encoder gave its first is an empty file. */
  finish(lastly = performance.now() + PATIENCE_MS) {
    if (this.recorder?.state !== "recording") return;
    if (this.parts.length || performance.now() > lastly) {
      this.recorder.stop();
      return;
    }
    this.compose();
    this.recorder.requestData();
    clearTimeout(this.limit);
    this.limit = setTimeout(() => this.finish(lastly), ASK_MS);
  }

  /** After each picture of the pitch. */
  drawn() {
    if (this.recorder) this.compose();
  }
}

function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
