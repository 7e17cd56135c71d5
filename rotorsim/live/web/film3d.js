// The film round the journal: its inner face is the journal, its outer face stands out by the pressure. The clearance is
// exaggerated: 25 um would not be seen on 40 mm.
import { OrbitControls, THREE } from "nicegui-scene";
import { cividis } from "./colours.js";
import { span } from "./film.js";

const SHARE = 0.15; // of the time, at most: a machine without a graphics processor has other work to do
const JOURNAL = 1, GAP = 0.35, HILL = 0.35, LENGTH = 2.2;

export class Film3d {
  constructor(canvas, rig) {
    this.canvas = canvas;
    this.rig = rig;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(38, 1, 0.1, 50);
    this.camera.up.set(0, 1, 0);
    this.camera.position.set(3.0, 1.9, 4.2);
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.controls = new OrbitControls(this.camera, canvas);
    this.next = 0;
    this.scene.add(new THREE.AmbientLight(0xffffff, 1.2));
    const lamp = new THREE.DirectionalLight(0xffffff, 2.2);
    lamp.position.set(3, 5, 4);
    this.scene.add(lamp);
    const round = new THREE.CylinderGeometry(JOURNAL, JOURNAL, LENGTH * 1.25, 48);
    round.rotateX(Math.PI / 2);
    this.journal = new THREE.Mesh(round, new THREE.MeshStandardMaterial({ color: 0x8a8f98, metalness: 0.4, roughness: 0.5 }));
    const mark = new THREE.Mesh(new THREE.BoxGeometry(0.9 * JOURNAL, 0.06, 0.02), new THREE.MeshStandardMaterial({ color: 0xd55e00 }));
    mark.position.set(0.45 * JOURNAL, 0, LENGTH * 0.63);
    this.journal.add(mark);
    this.scene.add(this.journal, this.film());
  }

  film() {
    const n = this.rig.theta.length, m = this.rig.z.length, geometry = new THREE.BufferGeometry();
    this.place = new THREE.BufferAttribute(new Float32Array((n + 1) * m * 3), 3);
    this.colour = new THREE.BufferAttribute(new Float32Array((n + 1) * m * 3), 3);
    geometry.setAttribute("position", this.place);
    geometry.setAttribute("color", this.colour);
    const faces = [];
    for (let i = 0; i < n; i++) for (let j = 0; j + 1 < m; j++) {
      const a = i * m + j, b = (i + 1) * m + j;
      faces.push(a, b, a + 1, b, b + 1, a + 1);
    }
    geometry.setIndex(faces);
    const material = new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide, transparent: true, opacity: 0.86 });
    return new THREE.Mesh(geometry, material);
  }

  draw(film, journal, angle) {
    const began = performance.now();
    if (began < this.next) return;
    this.shape(film, journal, angle);
    this.renderer.render(this.scene, this.camera);
    this.renderer.getContext().finish();
    this.next = began + (performance.now() - began) / SHARE;
  }

  shape(film, journal, angle) {
    const { theta, z } = this.rig, n = theta.length, m = z.length, [low, high] = span(film);
    const middle = (z[0] + z[m - 1]) / 2, length = z[m - 1] - z[0];
    for (let i = 0; i <= n; i++) for (let j = 0; j < m; j++) {
      const share = (film[(i % n) * m + j] - low) / (high - low), a = (theta[i % n] * Math.PI) / 180, k = i * m + j;
      const r = JOURNAL + GAP + HILL * share, c = cividis(share);
      this.place.setXYZ(k, r * Math.cos(a), r * Math.sin(a), ((z[j] - middle) / length) * LENGTH);
      this.colour.setXYZ(k, c[0] / 255, c[1] / 255, c[2] / 255);
    }
    this.place.needsUpdate = this.colour.needsUpdate = true;
    if (journal) this.journal.position.set((journal[0] / this.rig.clearance) * GAP, (journal[1] / this.rig.clearance) * GAP, 0);
    this.journal.rotation.z = angle;
    const w = this.canvas.parentElement.clientWidth, h = this.canvas.parentElement.clientHeight;
    if (this.wide !== w || this.high !== h) {
      [this.wide, this.high] = [w, h];
      this.renderer.setSize(w, h, false);
      this.camera.aspect = w / Math.max(h, 1);
      this.camera.updateProjectionMatrix();
    }
    this.controls.update();
  }

  close() {
    this.controls.dispose();
    this.renderer.dispose();
  }
}
