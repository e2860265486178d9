/** A camera on an orbit: perspective from the world [m] to pixels. */

export const VIEWS = {
  arm: { centre: [0.95, 0.62, 0.12], azimuth: -62, elevation: 27, distance: 3.6 },
  side: { centre: [1.0, 0.75, 0.2], azimuth: 0, elevation: 6, distance: 4.0, follows: true },
  above: { centre: [1.0, 0.75, 0.0], azimuth: -90, elevation: 88, distance: 4.4 },
  circle: { centre: [1.5, 1.5, 0.36], azimuth: -62, elevation: 26, distance: 0.95 },
};

/** Half the picture's width over its distance. */
const OPENING = 0.36;
const NEAREST = 0.05;

export class Camera {
  constructor(view) {
    this.take(view);
  }

  take(view) {
    Object.assign(this, { follows: false }, view);
  }

  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.min(88, Math.max(-20, this.elevation + elevation));
    this.follows = false;
  }

  zoom(factor) {
    this.distance = Math.min(12, Math.max(0.25, this.distance * factor));
  }

  /** The projection onto a picture: a function from [x, y, z] to [x, y, depth, pixels per metre], null behind. */
  projection(width, height) {
    const [azimuth, elevation] = [this.azimuth, this.elevation].map((angle) => (angle * Math.PI) / 180);
    const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
    const scale = Math.min(width, 1.45 * height) / (2 * OPENING);
    return ([x, y, z]) => {
      const [dx, dy, dz] = [x - this.centre[0], y - this.centre[1], z - this.centre[2]];
      const depth = this.distance - (dx * ce * ca + dy * ce * sa + dz * se);
      if (depth < NEAREST) return null;
      const right = -dx * sa + dy * ca;
      const up = -dx * se * ca - dy * se * sa + dz * ce;
      return [width / 2 + (scale * right) / depth, height / 2 - (scale * up) / depth, depth, scale / depth];
    };
  }
}
