-- NAME: a small arm in a vertical plane. A motor turns its first link, the second link is flexible, and the
-- load at its end keeps its height. Lengths in m, masses in kg, times in s, forces in N, angles in rad.
--
--   check what Refdyn reads:                   refdyn check NAME.lua
--   static deflection and holding torques:     refdyn statics NAME.lua --set programme=false
--   frequencies and damping ratios:            refdyn modes NAME.lua --set programme=false -o modes.json
--   a motion:                                  refdyn sim NAME.lua --from statics --until 2 -o NAME.csv
--   figures of the motion:                     refdyn plot NAME.csv -o NAME.svg
--   the moving arm, for a browser:             refdyn view NAME.csv --model NAME.lua -o NAME.html
--   a page with sliders, to send on:           refdyn view --live NAME.lua -o NAME_live.html
--   its equations as C:                        refdyn gen NAME.lua -o emitted
local rd = require "refdyn"

-- Options decide the structure of the model: refdyn sim NAME.lua --set elements=8 ...
local elements  = rd.option("elements", 4, { from = 1, to = 40 }) -- of the beam; 1: a rigid link
local programme = rd.option("programme", true)                    -- false: no rows, the arm moves freely

-- Parameters are values: name, value, unit. refdyn sim NAME.lua --set m_load=0.5 ... does not compile the C again.
local p = rd.parameters {
  { "m_load", 0.2, "kg" },                          -- mass at the tip
  { "E", 7e10, "Pa" }, { "nu", 0.33, "1" },         -- aluminium: Young's modulus, Poisson's ratio (for torsion),
  { "rho", 2700, "kg/m^3" }, { "eta", 2e-4, "s" },  -- density, and damping over stiffness
  { "rate", 0.4, "rad/s" },                         -- of the motor, once it has started
  { "alpha", 50, "1/s" }, { "beta", 50, "1/s" },    -- decay rates of errors of the rows
}

-- Inputs may change during a motion: refdyn sim NAME.lua --inputs push.csv, with the columns t,push
local push = rd.input("push", 0, "N") -- horizontal, at the load

return rd.model {
  name = "NAME", gravity = { 0, 0, -9.81 },
  links = {
    -- A rigid link on the ground. `turn` makes its z axis, about which `psi` turns, normal to the vertical plane.
    -- `center` and `inertia` refer to its own frame: origin at the joint, x along the link.
    { "upper", turn = { { "x", rd.pi / 2 } }, joint = "psi", start = { psi = 0.9 }, -- upper_psi
      mass = 0.5, center = { 0.2, 0, 0 }, inertia = { zz = 7e-3 } },
    -- A beam along its x axis. Its elements bend about z: coordinates lower_psi_1, lower_psi_2 ...
    { "lower", on = "upper", at = { 0.4, 0, 0 }, joint = "psi", start = { psi = -1.4 }, damper = { psi = 0.01 },
      beam = { length = 0.5, section = rd.tube(0.010, 0.008), E = p.E, nu = p.nu, rho = p.rho, eta = p.eta,
               rfe = elements, dofs = "psi" } },
    -- A link without a joint is fixed to its carrier. A mass without inertia is a point mass.
    { "load", on = "lower.tip", mass = p.m_load },
  },

  -- Points whose motion is recorded: columns tip_x, tip_z, tip_xd ... of a motion.
  points = { tip = "load" },

  -- Forces in addition to gravity, springs and dampers. `s` is the state: s.t, s.q.upper_psi, s.points.tip.x ...
  forces = function(s) return { rd.force { "tip", { push, 0, 0 } } } end,

  -- The programme: each row is an expression of positions, velocities or accelerations that the motion keeps at zero.
  constraints = programme and function(s)
    local height = rd.parameter("height", s.start.points.tip.z, "m") -- its value when a motion starts
    return {
      rd.position { s.points.tip.z - height, alpha = p.alpha, beta = p.beta, name = "height" },
      rd.velocity { s.qd.upper_psi - p.rate * rd.smoothstep(s.t, 0, 0.5), alpha = p.alpha, name = "motor" },
    }
  end or nil,

  -- The motors hold these joints in statics and modes.
  hold = { "upper_psi", "lower_psi" },
}

-- To try next: another load (--set m_load=1), a third link on "load", a beam that also bends out of the plane and
-- twists (omit dofs), a height that changes with s.t, limits of the joints, C for programs of your own.
