// The live view: frames of this computer's camera go to the server, which answers with the curve.

const find = (id) => document.getElementById(id);

export function setUpLive({ ask, showMessage, attempt, redraw, saved }) {
  const live = { running: false, leave };
  let stream = null;
  let place = ""; // of this view on the server

  async function start() {
    leave();
    showMessage("");
    find("live-start").disabled = true;
    try {
      await open();
    } catch (error) {
      leave();
      throw error;
    } finally {
      find("live-start").disabled = false;
    }
    live.running = true;
    find("live-save").disabled = true;
    find("live-curve").replaceChildren();
    find("live-verdict").textContent = "Waiting for frames…";
    find("live-counts").textContent = "";
    redraw();
    find("live-heading").focus({ preventScroll: true });
    find("live").scrollIntoView();
    attempt(run)();
  }

  async function open() {
    if (!navigator.mediaDevices) throw new Error("This browser gives pages no camera here: use chartless watch in a terminal.");
    stream = await navigator.mediaDevices.getUserMedia({ video: { width: { ideal: 1280 } }, audio: false })
      .catch((error) => {
        throw new Error(`The camera cannot be used (${error.message}): allow it, or close what uses it.`);
      });
    stream.getVideoTracks()[0].addEventListener("ended", attempt(() => {
      leave();
      throw new Error("The camera has stopped: connect it and start it again.");
    }));
    const video = find("video");
    video.srcObject = stream;
    await video.play();
    const { id } = await (await ask("live", { method: "POST" })).json();
    place = `live/${id}`;
  }

  async function run() {
    const video = find("video");
    const mine = stream;
    try {
      while (stream === mine) {
        await nextFrame(video);
        const { query, body } = await pixels(video);
        if (stream !== mine) break;
        const path = `${place}/frames?${query}&until=${find("live-until").value || 0}`;
        const answer = await (await ask(path, { method: "POST", body })).json();
        if (stream !== mine) break;
        draw(answer);
        if (answer.is_enough && find("live-auto").checked) await save();
      }
    } catch (error) {
      if (stream === mine) leave();
      throw error;
    }
  }

  function draw(answer) {
    find("live-counts").textContent = answer.counts;
    if (!("curve" in answer)) return; // it is drawn anew only now and then
    find("live-curve").innerHTML = answer.curve;
    find("live-save").textContent = answer.is_enough ? "Save" : "Save as it is";
    find("live-save").disabled = !answer.curve;
    if (find("live-verdict").textContent !== answer.note) find("live-verdict").textContent = answer.note;
  }

  async function save() {
    if (find("live-save").disabled) return; // it is being saved
    find("live-save").disabled = true;
    const { id } = await (await ask(`${place}/save`, { method: "POST" })).json();
    leave();
    await saved(id);
  }

  function leave() {
    for (const track of stream?.getTracks() ?? []) track.stop();
    stream = null;
    find("video").srcObject = null;
    if (!live.running) return;
    live.running = false;
    redraw();
  }

  find("live-start").addEventListener("click", attempt(start));
  find("live-save").addEventListener("click", attempt(save));
  find("live-stop").addEventListener("click", leave);
  return live;
}

function nextFrame(video) {
  return new Promise((resolve) => {
    if (video.requestVideoFrameCallback) video.requestVideoFrameCallback(resolve);
    else requestAnimationFrame(resolve);
  });
}

// Luma as the camera driver gave it where the browser tells, else red, green and blue as it shows
// them.
async function pixels(video) {
  const { videoWidth: width, videoHeight: height } = video;
  if ("VideoFrame" in window) {
    const frame = new VideoFrame(video);
    try {
      if (/^(I4|NV12)/.test(frame.format ?? "")) {
        const all = new Uint8Array(frame.allocationSize());
        const [{ offset, stride }] = await frame.copyTo(all);
        const { width: w, height: h } = frame.visibleRect;
        const luma = new Uint8Array(w * h);
        for (let row = 0; row < h; row++) {
          luma.set(all.subarray(offset + row * stride, offset + row * stride + w), row * w);
        }
        const full = frame.colorSpace.fullRange ? 1 : 0;
        return { query: `width=${w}&height=${h}&kind=luma&full=${full}`, body: luma };
      }
    } finally {
      frame.close();
    }
  }
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(video, 0, 0);
  const body = context.getImageData(0, 0, width, height).data;
  return { query: `width=${width}&height=${height}&kind=rgba&full=1`, body };
}
