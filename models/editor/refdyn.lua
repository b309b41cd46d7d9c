---@meta refdyn
-- Definitions for editors, made from the tables of fields and operators: do not edit.

---@class refdyn.expression

---@class refdyn.model
---@field name string name of the model and of the emitted files, an identifier of C
---@field gravity? (refdyn.expression|number)[] gravitational acceleration in the ground frame; default: none [m/s^2]
---@field length? number unit of length: tolerances treat a translation by this length like a turn of 1 rad; default: 1 [m]
---@field links table[] the links in any order; coordinates are numbered in this order, carriers first
---@field points? table points of interest by name, each a place (`"arm"`, `"arm.tip"`) or a table
---@field forces? fun(s: table): table takes the state, returns generalized forces by coordinate, added to Q, and a list of `rd.spring`, `rd.force` ... [N or N m]
---@field states? fun(s: table): table takes the state, returns a list of `rd.state`: continuous states of controllers and drives, which formulas read as `s.states.NAME`
---@field courses? fun(s: table): table takes the state, returns a table of named values that a motion records and `plot` draws
---@field limits? fun(s: table): table takes the state, returns a list of named values with bounds, [limits](#limits), that motions are compared with
---@field constraints? fun(s: table): table takes the state, returns a list of rows: `rd.position`, `rd.loop` ..., or lists of them
---@field events? fun(s: table): table takes the state, returns a list of `rd.event` and `rd.sampled`, or lists of them
---@field drives? (string|table)[] what moves the mechanism in place of ideal forces: coordinates, or tables, [drives](#drives); each becomes an input `drive_NAME`
---@field dependent? string|string[] dependent coordinates, as many as rows; default: chosen at run time
---@field hold? string|string[] coordinates that statics and modes keep fixed, in addition to the position rows
---@field form? string `"corrected"` (default), or `"printed"`: h and Q with the slips of the source chapter

---@class refdyn.link
---@field [1]? string
---@field name? string name, an identifier of C
---@field on? string the link that carries it: `"arm"`, or `"arm.tip"` for the end of a beam; default: the ground
---@field along? refdyn.expression|number distance along the beam that carries it, from the root [m]
---@field at? (refdyn.expression|number)[] position of its frame in the carrier's frame [m]
---@field turn? table[] constant rotations `{ "x", angle }` in order, each about an axis of the frame turned so far [rad]
---@field joint? string|string[] coordinates from the carrier outward: slides `x y z`, turns `phi theta psi` about x, y, z; `"free"`: `x y z psi theta phi`; default: welded
---@field axis? string|number[] direction, in the link's frame, of the only coordinate of a link: three numbers of any length
---@field coordinate? string name of the only coordinate of a link, an identifier of C; default: `LINK_JOINT`
---@field start? table<string, refdyn.expression|number> coordinates at the start of a motion [m or rad]
---@field start_rate? table<string, refdyn.expression|number> rates at the start of a motion [m/s or rad/s]
---@field spring? table<string, refdyn.expression|number> stiffness of linear springs [N/m or N m]
---@field rest? table<string, refdyn.expression|number> coordinates at which the springs exert no force; default: 0 [m or rad]
---@field damper? table<string, refdyn.expression|number> linear damping [N s/m or N m s]
---@field rotor? table<string, table> rotors of the drives, by joint; their inertia turns with the coordinate
---@field limits? table<string, table> limits, by joint; motions are compared with them and not changed by them
---@field mass? refdyn.expression|number mass, in addition to the beam and the bodies; without `inertia` a point mass [kg]
---@field center? (refdyn.expression|number)[] centre of mass in the link's frame; default: its origin [m]
---@field inertia? table inertia about the centre of mass, along the link's axes
---@field bodies? table[] solids that move with the link's frame: `rd.box`, `rd.cylinder`, `rd.tube`, `rd.sphere`, or mass data
---@field beam? table makes the link a flexible beam along its x axis

---@class refdyn.rotor
---@field inertia refdyn.expression|number moment of inertia about its own axis [kg m^2]
---@field gear? refdyn.expression|number turn of the rotor per turn, or per metre, of the joint, of either sign; default: 1 [1 or rad/m]

---@class refdyn.limits
---@field from? number smallest coordinate; default here and below: no limit [m or rad]
---@field to? number largest coordinate [m or rad]
---@field rate? number largest rate in either direction [m/s or rad/s]
---@field force? number largest programme force in either direction [N or N m]

---@class refdyn.inertia
---@field xx? refdyn.expression|number int y^2 + z^2 dm [kg m^2]
---@field yy? refdyn.expression|number int x^2 + z^2 dm [kg m^2]
---@field zz? refdyn.expression|number int x^2 + y^2 dm [kg m^2]
---@field xy? refdyn.expression|number -int x y dm, the entry of the tensor [kg m^2]
---@field xz? refdyn.expression|number -int x z dm [kg m^2]
---@field yz? refdyn.expression|number -int y z dm [kg m^2]

---@class refdyn.body
---@field mass refdyn.expression|number mass; without `inertia` a point mass [kg]
---@field center? (refdyn.expression|number)[] centre of mass in the body's frame; default: its origin [m]
---@field inertia? table inertia about the centre of mass, along the body's axes
---@field at? (refdyn.expression|number)[] position of its frame in the link's frame [m]
---@field turn? table[] constant rotations, as for links [rad]

---@class refdyn.box
---@field [1]? (refdyn.expression|number)[]
---@field size? (refdyn.expression|number)[] lengths of its edges along x, y, z [m]
---@field density? refdyn.expression|number density; this or `mass` must be given [kg/m^3]
---@field mass? refdyn.expression|number mass; this or `density` must be given [kg]
---@field at? (refdyn.expression|number)[] position of its centre in the link's frame [m]
---@field turn? table[] constant rotations, as for links [rad]

---@class refdyn.cylinder
---@field diameter refdyn.expression|number diameter [m]
---@field axis? string its axis: `"x"` (default, as for beams), `"y"` or `"z"`
---@field length refdyn.expression|number length along its axis [m]
---@field density? refdyn.expression|number density; this or `mass` must be given [kg/m^3]
---@field mass? refdyn.expression|number mass; this or `density` must be given [kg]
---@field at? (refdyn.expression|number)[] position of its centre in the link's frame [m]
---@field turn? table[] constant rotations, as for links [rad]

---@class refdyn.tube
---@field outer refdyn.expression|number outer diameter [m]
---@field inner refdyn.expression|number inner diameter [m]
---@field axis? string its axis: `"x"` (default, as for beams), `"y"` or `"z"`
---@field length refdyn.expression|number length along its axis [m]
---@field density? refdyn.expression|number density; this or `mass` must be given [kg/m^3]
---@field mass? refdyn.expression|number mass; this or `density` must be given [kg]
---@field at? (refdyn.expression|number)[] position of its centre in the link's frame [m]
---@field turn? table[] constant rotations, as for links [rad]

---@class refdyn.sphere
---@field diameter refdyn.expression|number diameter [m]
---@field density? refdyn.expression|number density; this or `mass` must be given [kg/m^3]
---@field mass? refdyn.expression|number mass; this or `density` must be given [kg]
---@field at? (refdyn.expression|number)[] position of its centre in the link's frame [m]
---@field turn? table[] constant rotations, as for links [rad]

---@class refdyn.beam
---@field length? refdyn.expression|number length [m]
---@field section? table cross-section: `rd.round(d)`, `rd.tube(outer, inner)`, `rd.rectangle(width_y, height_z)`, or its four numbers
---@field E? refdyn.expression|number Young's modulus [Pa]
---@field nu? refdyn.expression|number Poisson's ratio
---@field rho? refdyn.expression|number density [kg/m^3]
---@field eta? refdyn.expression|number damping over stiffness (Kelvin-Voigt) [s]
---@field damping? table damping by other measures: of an element, or the damping ratio of a mode
---@field curvature? table curvature of the unloaded beam
---@field rfe? integer number of rigid finite elements; 1: a rigid link
---@field springs? string springs of elements with all three turns: `"symmetric"` (default) treats the turns alike, `"printed"` has one on each turn, like the source chapter
---@field dofs? string|string[] which of `psi theta phi` an element has; default: all three
---@field segments? table[] consecutive stretches of the beam, rigidly joined

---@class refdyn.segment
---@field length refdyn.expression|number length [m]
---@field section? table cross-section; default here and below: the value of the beam
---@field E? refdyn.expression|number Young's modulus [Pa]
---@field nu? refdyn.expression|number Poisson's ratio
---@field rho? refdyn.expression|number density [kg/m^3]
---@field eta? refdyn.expression|number damping over stiffness (Kelvin-Voigt) [s]
---@field damping? table damping by other measures: of an element, or the damping ratio of a mode
---@field curvature? table curvature of the unloaded segment
---@field rfe? integer number of its rigid finite elements; its first forms one piece with the last of the segment before

---@class refdyn.section
---@field area refdyn.expression|number area [m^2]
---@field Iy refdyn.expression|number int z^2 dA: bending about y (theta) [m^4]
---@field Iz refdyn.expression|number int y^2 dA: bending about z (psi) [m^4]
---@field It refdyn.expression|number torsion constant (phi) [m^4]

---@class refdyn.damping
---@field psi? refdyn.expression|number of one spring-damping element, in bending about z [N m s]
---@field theta? refdyn.expression|number of one spring-damping element, in bending about y [N m s]
---@field phi? refdyn.expression|number of one spring-damping element, in torsion [N m s]
---@field ratio? refdyn.expression|number damping ratio of one mode: eta = 2 ratio / omega
---@field mode? integer number of that mode of the beam clamped at its root: 1 (default), 2 or 3
---@field tip_mass? refdyn.expression|number point mass at the end of the beam in that mode [kg]
---@field frequency? refdyn.expression|number frequency at which the ratio is valid, instead of a mode [Hz]

---@class refdyn.curvature
---@field psi? refdyn.expression|number about z [rad/m]
---@field theta? refdyn.expression|number about y [rad/m]
---@field phi? refdyn.expression|number twist [rad/m]

---@class refdyn.point
---@field on string the link that carries it, as for links
---@field along? refdyn.expression|number distance along the beam that carries it, from the root [m]
---@field at? (refdyn.expression|number)[] position in the carrier's frame [m]
---@field turn? table[] constant rotations of its axes, as for links [rad]
---@field angular? boolean for points of interest: `true` also emits the spatial Jacobian `J` and its drift `Jd_qd`

---@class refdyn.axis
---@field [1]? string
---@field on? string what it is fixed to: a link, written as for links, or a point of interest
---@field [2]? string|number[]
---@field direction? string|number[] `"x"`, `"y"` or `"z"` of that frame, or three numbers of any length
---@field along? refdyn.expression|number distance along a beam, from the root [m]
---@field at? (refdyn.expression|number)[] a point of the axis in that frame [m]
---@field turn? table[] constant rotations, as for links [rad]

---@class refdyn.spring
---@field [1]? string|table
---@field from? string|table one end
---@field [2]? string|table
---@field to? string|table the other end
---@field stiffness refdyn.expression|number stiffness [N/m]
---@field rest? refdyn.expression|number length at which it exerts no force; default: 0 [m]

---@class refdyn.damper
---@field [1]? string|table
---@field from? string|table one end
---@field [2]? string|table
---@field to? string|table the other end
---@field damping refdyn.expression|number force per rate of its length [N s/m]

---@class refdyn.actuator
---@field [1]? string|table
---@field from? string|table one end
---@field [2]? string|table
---@field to? string|table the other end
---@field [3]? refdyn.expression|number
---@field force? refdyn.expression|number force along the line between the ends; positive pushes them apart [N]

---@class refdyn.force
---@field [1]? string|table
---@field at? string|table where it acts
---@field [2]? (refdyn.expression|number)[]
---@field value? (refdyn.expression|number)[] its components [N]
---@field axes? string the link or point in whose axes the components are given; default: the ground

---@class refdyn.torque
---@field [1]? string|table
---@field on? string|table the link on which it acts
---@field [2]? (refdyn.expression|number)[]
---@field value? (refdyn.expression|number)[] its components [N m]
---@field axes? string the link or point in whose axes the components are given; default: the ground
---@field against? string|table the link on which the opposite torque acts; default: the ground

---@class refdyn.energy
---@field [1]? refdyn.expression|number
---@field value? refdyn.expression|number potential energy, an expression of coordinates and positions of points [J]

---@class refdyn.row
---@field [1]? refdyn.expression|number
---@field residual? refdyn.expression|number the expression that must be zero
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.loop
---@field [1]? string|table
---@field a? string|table a point
---@field [2]? string|table
---@field b? string|table the point that must coincide with it
---@field keep? string|string[] which of the ground's directions `x y z` have a row; default: all three
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.parallel
---@field [1]? table
---@field a? table an axis
---@field [2]? table
---@field b? table the axis parallel to it
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.perpendicular
---@field [1]? table
---@field a? table an axis
---@field [2]? table
---@field b? table the axis at right angles to it
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.on_line
---@field [1]? string|table
---@field point? string|table a point
---@field [2]? table
---@field line? table the axis on which it stays
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.on_plane
---@field [1]? string|table
---@field point? string|table a point
---@field [2]? table
---@field plane? table a point of the plane and its normal, as an axis
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.distance
---@field [1]? string|table
---@field a? string|table a point
---@field [2]? string|table
---@field b? string|table another point
---@field [3]? refdyn.expression|number
---@field length? refdyn.expression|number their distance, which may depend on time [m]
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.orientation
---@field [1]? string|table
---@field of? string|table what is oriented: a point of interest or a link
---@field [2]? table[]
---@field target? table[] turns from the ground's axes to the required axes; `{}` requires the ground's [rad]
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.close
---@field [1]? string|table
---@field a? string|table the joint's frame on the link that it carries
---@field [2]? string|table
---@field b? string|table the joint's frame on its carrier
---@field joint string|string[] the coordinates that it leaves free, as for links, or `"ball"` or `"weld"`; slides before turns
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.drive
---@field [1]? string
---@field coordinate? string a coordinate
---@field [2]? refdyn.expression|number
---@field value? refdyn.expression|number its value as a function of time [m or rad]
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.lock
---@field [1]? string
---@field coordinate? string a coordinate
---@field [2]? refdyn.expression|number
---@field value? refdyn.expression|number the value that it keeps; default: its value at the start, the parameter `lock_COORDINATE` [m or rad]
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; default: `row 1`, `loop 1 x` and so on

---@class refdyn.contact
---@field [1]? refdyn.expression|number
---@field gap? refdyn.expression|number the distance that must not fall below 0, an expression of t, q and points
---@field restitution? refdyn.expression|number speed of opening after an impact over speed of closing before it; default: 0
---@field alpha? refdyn.expression|number Baumgarte gain of the rate, while the contact rests [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position, while the contact rests [1/s]
---@field name? string name in reports, an identifier of C; default: `contact_1` and so on

---@class refdyn.event
---@field [1]? refdyn.expression|number
---@field value? refdyn.expression|number the expression that crosses zero at the event, of t, q, qd, points and inputs
---@field direction? string crossings that count: `"down"` (falling), `"up"` (rising), `"both"`; default: `"both"`, with `restitution` `"down"`
---@field ends? boolean `true` ends the motion there
---@field restitution? refdyn.expression|number an impact: speed of the value after it over speed before it; the impulse is along the gradient of the value
---@field rates? table<string, refdyn.expression|number> rates, by coordinate, that the event sets [m/s or rad/s]
---@field states? table<string, refdyn.expression|number> continuous states that the event sets
---@field inputs? table<string, refdyn.expression|number> inputs that the event sets
---@field parameters? table<string, refdyn.expression|number> parameters that the event sets
---@field name? string name in reports; default: `event 1` and so on

---@class refdyn.sampled
---@field every refdyn.expression|number time between samples; the first one is at t = 0 [s]
---@field inputs? table<string, refdyn.expression|number> inputs that a sample sets, from the values before it
---@field parameters? table<string, refdyn.expression|number> parameters that a sample sets
---@field name? string name in reports; default: `event 1` and so on

---@class refdyn.state
---@field [1]? string
---@field name? string name, an identifier of C, also that of its column in a motion
---@field rate refdyn.expression|number its time derivative, an expression of t, q, qd, points, inputs and states
---@field start? refdyn.expression|number value at the start of a motion; default: 0
---@field unit? string unit of its column; default: none
---@field scale? number change that tolerances treat like a turn of 1 rad, in its unit; default: 1

---@class refdyn.bound
---@field [1]? string
---@field name? string name in reports, and of the column of `value`
---@field [2]? refdyn.expression|number
---@field value? refdyn.expression|number the value: an expression of t, q, qd, points and inputs
---@field column? string instead of `value`, a column of the motion: a coordinate, also with `_d` or `_dd`, a state, its programme force `force_COORDINATE`, a component of a point such as `E_xdd`, or a course
---@field from? number smallest value; default: none
---@field to? number largest value; default: none. One of the two is needed

---@class refdyn.timing
---@field [1]? refdyn.expression|number
---@field t? refdyn.expression|number the time since the start of the law, such as `s.t - p.T0` [s]
---@field length? refdyn.expression|number length of the way [m or rad]
---@field rate? refdyn.expression|number a law by bounds: largest rate [m/s or rad/s]
---@field acceleration? refdyn.expression|number largest acceleration [m/s^2 or rad/s^2]
---@field jerk? refdyn.expression|number largest jerk; default: the acceleration jumps [m/s^3 or rad/s^3]
---@field speeds? (refdyn.expression|number)[] a law by speeds at equal distances along the way, ends included [m/s or rad/s]
---@field knots? table[] a law by knots `{ time, way }`: times are plain numbers from 0 on, ways also expressions in parameters
---@field control? (refdyn.expression|number)[] a law by control points of a cubic B-spline: ways, the first and last included, that attract it at equal distances in time [m or rad]
---@field duration? refdyn.expression|number of a law by knots or control points; default with `knots`: the time of the last knot [s]
---@field degree? integer of the polynomials between knots: 3, at rest at both ends, or 5, also without acceleration there; default: 3

---@class refdyn.effort
---@field [1]? string
---@field name? string the coordinate on which it acts; with `from` and `to` a name, an identifier of C
---@field from? string|table place from which it pushes: it acts along the line to `to`, and a positive force drives them apart
---@field to? string|table place that it pushes
---@field limit? number largest force in either direction; default: the limit `force` of the coordinate [N or N m]

---@class refdyn.shaper
---@field [1]? refdyn.expression|number
---@field course? refdyn.expression|number a course in time that is at rest before t = 0
---@field frequency refdyn.expression|number `frequency` of the mode, from `refdyn modes` [Hz]
---@field damping? refdyn.expression|number `damping` of the mode; default: 0
---@field kind? string `"zv"`, `"zvd"` or `"ei"`; default: `"zv"`

---@class refdyn
---@field pi number
local rd = {}

---@param fields refdyn.model
function rd.model(fields) end
---@param fields refdyn.box
function rd.box(fields) end
---@param fields refdyn.cylinder
function rd.cylinder(fields) end
---@param fields refdyn.tube
function rd.tube(fields) end
---@param fields refdyn.sphere
function rd.sphere(fields) end
---@param fields refdyn.spring
function rd.spring(fields) end
---@param fields refdyn.damper
function rd.damper(fields) end
---@param fields refdyn.actuator
function rd.actuator(fields) end
---@param fields refdyn.force
function rd.force(fields) end
---@param fields refdyn.torque
function rd.torque(fields) end
---@param fields refdyn.energy
function rd.energy(fields) end
---@param fields refdyn.loop
function rd.loop(fields) end
---@param fields refdyn.parallel
function rd.parallel(fields) end
---@param fields refdyn.perpendicular
function rd.perpendicular(fields) end
---@param fields refdyn.on_line
function rd.on_line(fields) end
---@param fields refdyn.on_plane
function rd.on_plane(fields) end
---@param fields refdyn.distance
function rd.distance(fields) end
---@param fields refdyn.orientation
function rd.orientation(fields) end
---@param fields refdyn.close
function rd.close(fields) end
---@param fields refdyn.drive
function rd.drive(fields) end
---@param fields refdyn.lock
function rd.lock(fields) end
---@param fields refdyn.contact
function rd.contact(fields) end
---@param fields refdyn.event
function rd.event(fields) end
---@param fields refdyn.sampled
function rd.sampled(fields) end
---@param fields refdyn.state
function rd.state(fields) end
---@param fields refdyn.row
function rd.position(fields) end
---@param fields refdyn.row
function rd.velocity(fields) end
---@param fields refdyn.row
function rd.acceleration(fields) end
function rd.option(...) end
function rd.parameters(...) end
function rd.parameter(...) end
function rd.input(...) end
function rd.ramp(...) end
function rd.smoothstep(...) end
function rd.round(...) end
function rd.tube(...) end
function rd.rectangle(...) end
function rd.friction(...) end
function rd.spline(...) end
function rd.path(...) end
function rd.timing(...) end
function rd.shaper(...) end
function rd.rate(...) end
function rd.sin(...) end
function rd.cos(...) end
function rd.tan(...) end
function rd.asin(...) end
function rd.acos(...) end
function rd.atan(...) end
function rd.atan2(...) end
function rd.sinh(...) end
function rd.cosh(...) end
function rd.tanh(...) end
function rd.exp(...) end
function rd.log(...) end
function rd.sqrt(...) end
function rd.pow(...) end
function rd.abs(...) end
function rd.min(...) end
function rd.max(...) end
function rd.less(...) end
function rd.where(...) end

-- in sweep files of refdyn batch: docs/batches.md
function rd.sweep(fields) end
function rd.grid(from, to, count) end
function rd.log_grid(from, to, count) end
function rd.uniform(from, to) end
function rd.log_uniform(from, to) end
function rd.normal(mean, deviation) end

-- in fit files of refdyn fit: docs/fitting.md
function rd.fit(fields) end
function rd.free() end
function rd.within(from, to, start) end

-- in plan files of refdyn plan: docs/planning.md
function rd.plan(fields) end
function rd.within(from, to, start) end
function rd.at_end(column, bounds) end
function rd.integral(column) end
function rd.largest(column) end

return rd
