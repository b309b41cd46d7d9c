---@meta refdyn
-- Definitions for editors, made from the tables of fields and operators: do not edit.

---@class refdyn.expression

---@class refdyn.model
---@field name string name of the model and of the emitted files, an identifier of C
---@field gravity? (refdyn.expression|number)[] acceleration of gravity in the ground frame; left out: none [m/s^2]
---@field length? number unit of length: tolerances weigh a translation of this length as a turn of 1 rad; left out: 1 [m]
---@field links table[] list of links, in any order; coordinates are numbered in this order, parents first
---@field points? table points of interest by name, each a place (`"arm"`, `"arm.tip"`) or a table
---@field forces? fun(s: table): table of the state: generalized forces by coordinate, added to Q, and a list of `rd.spring`, `rd.force` ... [N or N m]
---@field courses? fun(s: table): table of the state: a table of named values to record with a motion, and to draw
---@field constraints? fun(s: table): table of the state: a list of rows: `rd.position`, `rd.loop` ..., or lists of them
---@field events? fun(s: table): table of the state: a list of `rd.event`, or lists of them
---@field dependent? string|string[] dependent coordinates, as many as rows; left out: chosen at run time
---@field hold? string|string[] coordinates held in statics, beside the rows of positions, and in modes
---@field form? string `"corrected"` (default), or `"printed"`: h and Q with the slips of the source chapter

---@class refdyn.link
---@field [1]? string
---@field name? string name, an identifier of C
---@field on? string the link that carries it: `"arm"`, or `"arm.tip"` for the end of a beam; left out: the ground
---@field along? refdyn.expression|number how far along the beam that carries it, from its root [m]
---@field at? (refdyn.expression|number)[] position of its frame in the carrier's frame [m]
---@field turn? table[] constant rotations `{ "x", angle }`, one after another, each about the axis turned so far [rad]
---@field joint? string|string[] coordinates from the carrier outward: slides `x y z`, turns `phi theta psi` about x, y, z; `"free"`: `x y z psi theta phi`; left out: welded
---@field axis? string|number[] direction, in the link's frame, along or about which its one coordinate goes instead: three numbers of any length
---@field start? table<string, refdyn.expression|number> coordinates at the start of a motion [m or rad]
---@field start_rate? table<string, refdyn.expression|number> their rates [m/s or rad/s]
---@field spring? table<string, refdyn.expression|number> stiffness of linear springs [N/m or N m]
---@field rest? table<string, refdyn.expression|number> coordinates at which the springs are free of force; left out: 0 [m or rad]
---@field damper? table<string, refdyn.expression|number> linear damping [N s/m or N m s]
---@field rotor? table<string, table> rotors of drives, by joint, whose inertia turns with the coordinate
---@field limits? table<string, table> limits, by joint, that motions are compared with; they change no motion
---@field mass? refdyn.expression|number mass, beside that of the beam and the bodies; alone: a point mass [kg]
---@field center? (refdyn.expression|number)[] centre of mass in the link's frame; left out: its origin [m]
---@field inertia? table inertia about the centre of mass, along the link's axes
---@field bodies? table[] list of solids that move with the link's frame: `rd.box`, `rd.cylinder`, `rd.tube`, `rd.sphere`, or mass data
---@field beam? table makes the link a flexible beam along its x axis

---@class refdyn.rotor
---@field inertia refdyn.expression|number moment about its own axis [kg m^2]
---@field gear? refdyn.expression|number its turn over that of the joint, or over the joint's way, of either sign; left out: 1 [1 or rad/m]

---@class refdyn.limits
---@field from? number smallest coordinate; left out, as the others: none [m or rad]
---@field to? number largest coordinate [m or rad]
---@field rate? number largest rate, either way [m/s or rad/s]
---@field force? number largest programme force, either way [N or N m]

---@class refdyn.inertia
---@field xx? refdyn.expression|number int y^2 + z^2 dm [kg m^2]
---@field yy? refdyn.expression|number int x^2 + z^2 dm [kg m^2]
---@field zz? refdyn.expression|number int x^2 + y^2 dm [kg m^2]
---@field xy? refdyn.expression|number -int x y dm, the entry of the tensor [kg m^2]
---@field xz? refdyn.expression|number -int x z dm [kg m^2]
---@field yz? refdyn.expression|number -int y z dm [kg m^2]

---@class refdyn.body
---@field mass refdyn.expression|number mass; alone: a point mass [kg]
---@field center? (refdyn.expression|number)[] centre of mass in the body's frame; left out: its origin [m]
---@field inertia? table inertia about the centre of mass, along the body's axes
---@field at? (refdyn.expression|number)[] position of its frame in the link's frame [m]
---@field turn? table[] constant rotations there [rad]

---@class refdyn.box
---@field [1]? (refdyn.expression|number)[]
---@field size? (refdyn.expression|number)[] its edges along x, y, z [m]
---@field density? refdyn.expression|number density; this or `mass` is needed [kg/m^3]
---@field mass? refdyn.expression|number mass; this or `density` is needed [kg]
---@field at? (refdyn.expression|number)[] position of its middle in the link's frame [m]
---@field turn? table[] constant rotations there [rad]

---@class refdyn.cylinder
---@field diameter refdyn.expression|number diameter [m]
---@field axis? string its axis, `"x"` (default, as of beams), `"y"` or `"z"`
---@field length refdyn.expression|number length along its axis [m]
---@field density? refdyn.expression|number density; this or `mass` is needed [kg/m^3]
---@field mass? refdyn.expression|number mass; this or `density` is needed [kg]
---@field at? (refdyn.expression|number)[] position of its middle in the link's frame [m]
---@field turn? table[] constant rotations there [rad]

---@class refdyn.tube
---@field outer refdyn.expression|number outer diameter [m]
---@field inner refdyn.expression|number inner diameter [m]
---@field axis? string its axis, `"x"` (default, as of beams), `"y"` or `"z"`
---@field length refdyn.expression|number length along its axis [m]
---@field density? refdyn.expression|number density; this or `mass` is needed [kg/m^3]
---@field mass? refdyn.expression|number mass; this or `density` is needed [kg]
---@field at? (refdyn.expression|number)[] position of its middle in the link's frame [m]
---@field turn? table[] constant rotations there [rad]

---@class refdyn.sphere
---@field diameter refdyn.expression|number diameter [m]
---@field density? refdyn.expression|number density; this or `mass` is needed [kg/m^3]
---@field mass? refdyn.expression|number mass; this or `density` is needed [kg]
---@field at? (refdyn.expression|number)[] position of its middle in the link's frame [m]
---@field turn? table[] constant rotations there [rad]

---@class refdyn.beam
---@field length? refdyn.expression|number length [m]
---@field section? table cross-section: `rd.round(d)`, `rd.tube(outer, inner)`, `rd.rectangle(width_y, height_z)`, or its four numbers
---@field E? refdyn.expression|number Young's modulus [Pa]
---@field nu? refdyn.expression|number Poisson's ratio
---@field rho? refdyn.expression|number density [kg/m^3]
---@field eta? refdyn.expression|number damping over stiffness (Kelvin-Voigt) [s]
---@field damping? table damping given otherwise: of an element, or as ratio of a mode
---@field curvature? table curvature of the unloaded beam
---@field rfe? integer number of rigid finite elements; 1: a rigid link
---@field springs? string springs of elements with all three turns: `"symmetric"` (default) in the turns, or `"printed"`: one on each turn, as the source chapter has them
---@field dofs? string|string[] which of `psi theta phi` an element has; left out: all three
---@field segments? table[] list of stretches one behind the other, rigidly joined

---@class refdyn.segment
---@field length refdyn.expression|number length [m]
---@field section? table cross-section; left out, this and what follows: that of the beam
---@field E? refdyn.expression|number Young's modulus [Pa]
---@field nu? refdyn.expression|number Poisson's ratio
---@field rho? refdyn.expression|number density [kg/m^3]
---@field eta? refdyn.expression|number damping over stiffness (Kelvin-Voigt) [s]
---@field damping? table damping given otherwise: of an element, or as ratio of a mode
---@field curvature? table curvature of the unloaded segment
---@field rfe? integer number of its rigid finite elements; the first continues the last one before it

---@class refdyn.section
---@field area refdyn.expression|number area [m^2]
---@field Iy refdyn.expression|number int z^2 dA: bending about y (theta) [m^4]
---@field Iz refdyn.expression|number int y^2 dA: bending about z (psi) [m^4]
---@field It refdyn.expression|number torsion constant (phi) [m^4]

---@class refdyn.damping
---@field psi? refdyn.expression|number of one spring-damping element, bending about z [N m s]
---@field theta? refdyn.expression|number of one spring-damping element, bending about y [N m s]
---@field phi? refdyn.expression|number of one spring-damping element, torsion [N m s]
---@field ratio? refdyn.expression|number damping ratio of one mode: eta = 2 ratio / omega
---@field mode? integer which: 1 (default), 2 or 3, of the beam clamped at its root
---@field tip_mass? refdyn.expression|number a point mass at its end, for that mode [kg]
---@field frequency? refdyn.expression|number the frequency that has this ratio, instead of a mode [Hz]

---@class refdyn.curvature
---@field psi? refdyn.expression|number about z [rad/m]
---@field theta? refdyn.expression|number about y [rad/m]
---@field phi? refdyn.expression|number twist [rad/m]

---@class refdyn.point
---@field on string the link that carries it, as for links
---@field along? refdyn.expression|number how far along the beam that carries it, from its root [m]
---@field at? (refdyn.expression|number)[] position in that frame [m]
---@field turn? table[] constant rotations of its axes, as for links [rad]
---@field angular? boolean of a point of interest: `true` emits its spatial Jacobian `J` and drift `Jd_qd`, too

---@class refdyn.axis
---@field [1]? string
---@field on? string what it is fixed to: a link, as for links, or a point of interest
---@field [2]? string|number[]
---@field direction? string|number[] `"x"`, `"y"`, `"z"` there, or three numbers, of any length
---@field along? refdyn.expression|number how far along a beam [m]
---@field at? (refdyn.expression|number)[] a point of it in that frame [m]
---@field turn? table[] constant rotations, as for links [rad]

---@class refdyn.spring
---@field [1]? string|table
---@field from? string|table one end
---@field [2]? string|table
---@field to? string|table the other end
---@field stiffness refdyn.expression|number stiffness [N/m]
---@field rest? refdyn.expression|number length at which it is free of force; left out: 0 [m]

---@class refdyn.damper
---@field [1]? string|table
---@field from? string|table one end
---@field [2]? string|table
---@field to? string|table the other end
---@field damping refdyn.expression|number force over rate of length [N s/m]

---@class refdyn.actuator
---@field [1]? string|table
---@field from? string|table one end
---@field [2]? string|table
---@field to? string|table the other end
---@field [3]? refdyn.expression|number
---@field force? refdyn.expression|number force along the line between both, positive: it pushes them apart [N]

---@class refdyn.force
---@field [1]? string|table
---@field at? string|table where it acts
---@field [2]? (refdyn.expression|number)[]
---@field value? (refdyn.expression|number)[] its components [N]
---@field axes? string the link or point whose axes the components follow; left out: fixed in space

---@class refdyn.torque
---@field [1]? string|table
---@field on? string|table the link on which it acts
---@field [2]? (refdyn.expression|number)[]
---@field value? (refdyn.expression|number)[] its components [N m]
---@field axes? string the link or point whose axes the components follow; left out: fixed in space
---@field against? string|table the link that bears the opposite torque; left out: the ground

---@class refdyn.energy
---@field [1]? refdyn.expression|number
---@field value? refdyn.expression|number potential energy, of coordinates and positions of points [J]

---@class refdyn.row
---@field [1]? refdyn.expression|number
---@field residual? refdyn.expression|number the expression that is to be zero
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.loop
---@field [1]? string|table
---@field a? string|table a point
---@field [2]? string|table
---@field b? string|table the point that coincides with it
---@field keep? string|string[] which of the ground's `x y z` have a row; left out: all three
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.parallel
---@field [1]? table
---@field a? table an axis
---@field [2]? table
---@field b? table the axis that is parallel to it
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.perpendicular
---@field [1]? table
---@field a? table an axis
---@field [2]? table
---@field b? table the axis that is at right angles to it
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.on_line
---@field [1]? string|table
---@field point? string|table a point
---@field [2]? table
---@field line? table the axis on which it stays
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.on_plane
---@field [1]? string|table
---@field point? string|table a point
---@field [2]? table
---@field plane? table a point of the plane, and its normal
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.distance
---@field [1]? string|table
---@field a? string|table a point
---@field [2]? string|table
---@field b? string|table another point
---@field [3]? refdyn.expression|number
---@field length? refdyn.expression|number their distance, also as a function of time [m]
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.orientation
---@field [1]? string|table
---@field of? string|table what is turned: a point of interest or a link
---@field [2]? table[]
---@field target? table[] turns that lead from the ground's axes to those that it is to have, `{}` for the ground's [rad]
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.close
---@field [1]? string|table
---@field a? string|table the joint's frame on what it carries
---@field [2]? string|table
---@field b? string|table the joint's frame on its carrier
---@field joint string|string[] what it leaves free, as for links, or `"ball"` or `"weld"`; slides before turns
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.drive
---@field [1]? string
---@field coordinate? string a coordinate
---@field [2]? refdyn.expression|number
---@field value? refdyn.expression|number what it is, a function of time [m or rad]
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.lock
---@field [1]? string
---@field coordinate? string a coordinate
---@field [2]? refdyn.expression|number
---@field value? refdyn.expression|number where it stays; left out: where the motion starts, the parameter `lock_COORDINATE` [m or rad]
---@field alpha? refdyn.expression|number Baumgarte gain of the rate [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position [1/s]
---@field name? string name in reports; left out: `row 1`, `loop 1 x` and so on

---@class refdyn.contact
---@field [1]? refdyn.expression|number
---@field gap? refdyn.expression|number the distance that must not fall below 0, of t, q and points
---@field restitution? refdyn.expression|number the gap opens so many times as fast as it closed; left out: 0
---@field alpha? refdyn.expression|number Baumgarte gain of the rate, while the contact rests [1/s]
---@field beta? refdyn.expression|number Baumgarte gain of the position, while the contact rests [1/s]
---@field name? string name in reports, an identifier of C; left out: `contact_1` and so on

---@class refdyn.event
---@field [1]? refdyn.expression|number
---@field value? refdyn.expression|number the expression whose zero it is, of t, q, qd, points and inputs
---@field direction? string `"down"`: it falls through zero, `"up"`: it rises, `"both"`; left out: `"both"`, with `restitution` `"down"`
---@field ends? boolean `true`: the motion ends there
---@field restitution? refdyn.expression|number an impact: the value leaves zero so many times as fast as it came, by an impulse along its gradient
---@field rates? table<string, refdyn.expression|number> rates by coordinate, which the event sets [m/s or rad/s]
---@field inputs? table<string, refdyn.expression|number> inputs that it sets
---@field parameters? table<string, refdyn.expression|number> parameters that it sets
---@field name? string name in reports; left out: `event 1` and so on

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

return rd
