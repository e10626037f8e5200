export class SpaceView {
  reset() {}
  update() {}
  windowChanged() {}
}
