/**
 * @file The messages between page and server (docs/architecture.md) and the page's state, for readers
 * and editors. Nothing runs here.
 *
 * @typedef {[number, number]} Vec2
 * @typedef {[number, number, number]} Vec3
 * @typedef {"translate"|"rotate"} Mode
 * @typedef {"pointer"|"keyboard"|"gamepad"} DeviceKind
 * @typedef {[number, number, number, number]} Axes  left x, left y, right x, right y; right and up positive
 *
 * @typedef {object} InputMessage
 * @property {"input"} type
 * @property {number} seq        rises by one, also over a reconnect
 * @property {number} t          the page's clock [ms]
 * @property {Vec2} left
 * @property {Vec2} right
 * @property {Mode} mode
 * @property {DeviceKind} device
 * @property {number} yaw        heading about world z of "away" on the right stick [rad]
 * @property {number} dead_zone
 *
 * @typedef {{name: string, colour: string, kind?: string}} SceneObject
 *
 * @typedef {object} Hello
 * @property {"hello"} type
 * @property {string} session
 * @property {string} version
 * @property {boolean} control          false: this page watches
 * @property {string} view              path of the viewer
 * @property {{name: string, objects: SceneObject[]}} scene
 * @property {string[]} methods
 * @property {Record<string, unknown>} settings
 * @property {Layers} layers
 * @property {string[]} [scenes]
 * @property {boolean} [recorded]
 * @property {number} [run]            counts the simulations that this session has started
 * @property {boolean} [hold_on_loss]   lost input stops the arm
 * @property {string|null} [watch]      a read-only link
 *
 * @typedef {Record<string, boolean|string>} Layers
 *
 * @typedef {object} TrialState
 * @property {number} number
 * @property {string} target
 * @property {string} method
 * @property {string} [shown_as]
 * @property {"ready"|"running"|"closing"|"lifting"|"done"} phase
 * @property {string} outcome           "running" or how it ended
 * @property {number} seconds
 * @property {number} input             [s]
 * @property {string} grasped           the object held, or empty
 * @property {string} scene
 * @property {number} seed
 * @property {boolean} [simulated]      a simulated user steers
 *
 * @typedef {object} Status             30 a second
 * @property {"status"} type
 * @property {TrialState} trial
 * @property {Record<string, number>} [belief]
 * @property {Vec3} [hand]              world frame [m]
 * @property {Record<string, Vec3>} [objects]   world frame [m]
 * @property {{left: Vec2, right: Vec2}} [assist_stick]  what assistance adds, full stick = 1
 * @property {{left: Vec2, right: Vec2, mode: Mode, yaw: number}} [sticks]  what is pushed, by whom ever
 * @property {""|"nobody"|"silent"|"blur"|"hidden"|"disconnected"} [loss]   why there is no input
 * @property {{hz: number, late: number, lateness_ms: number}} [loop]
 * @property {Record<string, unknown>} [settings]
 * @property {Layers} [layers]
 * @property {string} [camera]
 * @property {[number, number]|null} [value_range]       V on the slice [nat]
 * @property {Record<string, string>} [reason]
 *
 * @typedef {object} Connection
 * @property {"connected"|"reconnecting"|"lost"} state
 * @property {boolean} before           was connected once
 * @property {number|null} retryAt      when the next attempt is due, by performance.now() [ms]
 * @property {string} reason            why it is lost for good
 * @property {number|null} rtt          [ms]
 *
 * @typedef {{id: number, level: "info"|"warn"|"error", text: string}} Notice
 *
 * @typedef {object} State
 * @property {Connection} connection
 * @property {Hello|null} hello
 * @property {Status|null} status
 * @property {Axes} axes                what the page sends
 * @property {Mode} mode
 * @property {{kind: DeviceKind, name: string}} device
 * @property {number} yaw               sent with each input [rad]
 * @property {number} viewYaw           heading of the picture [rad]
 * @property {boolean} follow           directions follow the view
 * @property {"dark"|"light"} theme
 * @property {boolean} drawer
 * @property {boolean} menu
 * @property {boolean} layersOpen
 * @property {boolean} coach
 * @property {Notice[]} notices
 */
export {};
