-- A gantry whose hand follows a path through samples at a given speed, and turns by a spline of time. The path is
-- a quarter of a circle of 1 m about z, in 9 samples: its length is pi/2 m within 1e-3, and the hand's speed is
-- 0.1 m/s within 1e-7.
-- Spline through (0, 0), (1, 1), (2, 0), by hand: between 0 and 1 it is 1.5 t - 0.5 t^3, hence 0.6875 at 0.5.
local rd = require "refdyn"
local samples = {}
for i = 0, 8 do
  local angle = i * rd.pi / 16
  samples[#samples + 1] = { rd.cos(angle), rd.sin(angle), 0.5 }
end
local path, nod = rd.path(samples), rd.spline { { 0, 0 }, { 1, 1 }, { 2, 0 } }

return rd.model {
  name = "follow_path", gravity = { 0, 0, -9.81 },
  links = {
    { "hand", joint = { "x", "y", "z", "psi" }, start = { x = 1, z = 0.5 }, mass = 1, inertia = { zz = 0.01 } },
  },
  points = { E = "hand" },
  courses = function(s) return { nod = nod(s.t), speed = (s.points.E.xd^2 + s.points.E.yd^2)^0.5 } end,
  constraints = function(s)
    local E, rows, along = s.points.E, {}, 0.1 * s.t
    for _, axis in ipairs { "x", "y", "z" } do
      rows[#rows + 1] = rd.position { E[axis] - path[axis](along), alpha = 20, beta = 20, name = "path " .. axis }
    end
    return { rows, rd.drive { "hand_psi", nod(s.t), alpha = 20, beta = 20 } }
  end,
}
