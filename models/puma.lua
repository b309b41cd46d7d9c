-- The Puma 560 with a forearm that bends. Its six axes move the tool along a straight line and keep it level. Lengths
-- (standard Denavit-Hartenberg), masses and drives: P. Corke and B. Armstrong-Helouvry, "A search for consensus among
-- model parameters reported for the PUMA 560 robot", IEEE ICRA 1994. The flexible tube in the forearm is our own addition.
-- Checked with a rigid tube without mass: the mass matrix, the holding torques and the pose equal those of the Robotics
-- Toolbox at this start (P. Corke, "Robotics, Vision and Control"). Checked with the flexible tube: the programme and the
-- balance of energy.
local rd = require "refdyn"
local n  = rd.option("n_rfe", 2, { from = 1 })                          -- of the forearm; 1: rigid
local p  = rd.parameters {
  { "g", 9.81, "m/s^2" }, { "E", 7e10, "Pa" }, { "nu", 0.33, "1" }, { "rho", 2700, "kg/m^3" }, { "eta", 1e-4, "s" },
  { "x", (2 * 0.4318 - 0.0203) / rd.sqrt(2) + 0.05625, "m" }, { "y", -0.15005, "m" },  -- tool at the start
  { "z", 0.672 - 0.0203 / rd.sqrt(2), "m" }, { "way", 0.5, "m" }, { "T", 1.5, "s" },
}

-- Each joint turns about z; d along z, a along x and alpha about x follow. The mass data refer to the frame that results.
local axes = {
  { alpha = rd.pi / 2, motor = 2e-4, gear = -62.6111, body = { mass = 40, inertia = { yy = 0.35 } } },  -- mass: unused
  { a = 0.4318, start = rd.pi / 4, motor = 2e-4, gear = 107.815,
    body = { mass = 17.4, center = { -0.3638, 0.006, 0.2275 }, inertia = { xx = 0.13, yy = 0.524, zz = 0.539 } } },
  { d = 0.15005, a = 0.0203, alpha = -rd.pi / 2, start = rd.pi, motor = 2e-4, gear = -53.7063,
    body = { mass = 4.8, center = { -0.0203, -0.0141, 0.07 },           -- yy: the paper's 0.086 is impossible for a body
             inertia = { xx = 0.066, yy = 0.0785, zz = 0.0125 } } },
  { alpha = rd.pi / 2, motor = 33e-6, gear = 76.0364,
    body = { mass = 0.82, center = { 0, 0.019, 0 }, inertia = { xx = 1.8e-3, yy = 1.3e-3, zz = 1.8e-3 } } },
  { alpha = -rd.pi / 2, start = rd.pi / 4, motor = 33e-6, gear = 71.923,
    body = { mass = 0.34, inertia = { xx = 3e-4, yy = 4e-4, zz = 3e-4 } } },
  { motor = 33e-6, gear = 76.686,
    body = { mass = 0.09, center = { 0, 0, 0.032 }, inertia = { xx = 15e-5, yy = 15e-5, zz = 4e-5 } } },
}

-- The forearm follows the third axis. Its x axis, along the tube, is the fourth axis.
local third = axes[3]
local links = { { "forearm", on = "axis3", at = { third.a, 0, third.d },
                  turn = { { "x", third.alpha }, { "y", -rd.pi / 2 } },
                  beam = { length = 0.4318, section = rd.tube(0.034, 0.03), E = p.E, nu = p.nu, rho = p.rho,
                           eta = p.eta, rfe = n } } }
for i, axis in ipairs(axes) do
  local before   = axes[i - 1] or { d = 0.672 }                         -- height of the shoulder above the floor
  local on, turn = i > 1 and "axis" .. i - 1 or nil, { "x", before.alpha or 0 }
  if i == 4 then on, turn, before = "forearm.tip", { "y", rd.pi / 2 }, {} end
  axis.body.at, axis.body.turn = { axis.a or 0, 0, axis.d or 0 }, { { "x", axis.alpha or 0 } }
  links[i + 1] = { "axis" .. i, on = on, at = { before.a or 0, 0, before.d or 0 }, turn = { turn }, joint = "psi",
                   start = { psi = axis.start or 0 }, bodies = { axis.body },
                   rotor = { psi = { inertia = axis.motor, gear = axis.gear } } }
end

return rd.model {
  name = "puma", gravity = { 0, 0, -p.g },
  links = links,
  points = { tool = { on = "axis6", at = { 0, 0, 0.05625 } } },
  constraints = function(s)
    local tool = s.points.tool
    return {
      rd.position { tool.x - p.x, name = "x" }, rd.position { tool.z - p.z, name = "z" },
      rd.position { tool.y - p.y - p.way * rd.smoothstep(s.t, 0, p.T), name = "y" },
      rd.orientation { "tool", { { "y", rd.pi / 2 } }, name = "level" },
    }
  end,
}
