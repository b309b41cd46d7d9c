-- A trolley that rolls along a flexible jib, with a load on a rope. Rows hold it on the natural cubic spline through points
-- of the jib. The spline's curvature is continuous in the trolley's position, and so are the accelerations.
-- Checked against the deflection of a cantilever under its own weight and a single load, and against the theory of a mass
-- that moves along a beam. If the trolley rolls freely, the energy is constant, and the spline pushes it at right angles.
local rd    = require "refdyn"
local n     = rd.option("n_rfe", 5, { from = 3, to = 60 })
local drive = rd.option("drive", "course", { "course", "input" })
local p     = rd.parameters {
  { "L", 8, "m" }, { "E", 2.1e11, "Pa" }, { "nu", 0.3, "1" }, { "rho", 7850, "kg/m^3" }, { "eta", 1e-3, "s" },
  { "m_trolley", 40, "kg" }, { "m_load", 200, "kg" }, { "wheels", 0.1, "kg m^2" }, { "radius", 0.1, "m" },
  { "rope", 2.5, "m" }, { "swing", 0.15, "rad" }, { "sway", 0.08, "rad" }, { "g", 9.81, "m/s^2" },
  { "near", 2, "m" }, { "far", 7.5, "m" }, { "T", 5, "s" },
}
local cells = n - 1
local h     = p.L / cells

-- The function that is 1 at knot k, 0 at the others and between them the natural cubic spline.
local function weight(k)
  local samples = {}
  for i = 0, cells do samples[i + 1] = { i, i == k and 1 or 0 } end
  return rd.spline(samples)
end

local points = { load = { on = "rope", at = { 0, 0, -p.rope } } }
for k = 0, cells do points["knot_" .. k] = { on = "jib", along = k * h } end

return rd.model {
  name = "jib", gravity = { 0, 0, -p.g },
  links = {
    { "jib", beam = { length = p.L, section = rd.tube(0.15, 0.14), E = p.E, nu = p.nu, rho = p.rho, eta = p.eta, rfe = n,
                      dofs = "psi, theta" } },
    -- The trolley's position along the jib; its wheels turn by 1 / radius.
    { "travel", joint = "x", start = { x = p.near }, rotor = { x = { inertia = p.wheels, gear = 1 / p.radius } } },
    { "trolley", joint = "x, y, z", start = { x = p.near }, mass = p.m_trolley },
    { "rope", on = "trolley", joint = "theta, phi", start = { theta = p.swing, phi = p.sway },
      bodies = { { mass = p.m_load, center = { 0, 0, -p.rope } } } },
  },
  points = points,
  forces = function()
    return drive == "input" and { travel_x = rd.input("push", 0, "N") } or {}
  end,
  constraints = function(s)
    local rows = {}
    for _, axis in ipairs { "x", "y", "z" } do
      local at = 0
      for k = 0, cells do at = at + weight(k)(s.q.travel_x / h) * s.points["knot_" .. k][axis] end
      rows[#rows + 1] = rd.position { s.q["trolley_" .. axis] - at, name = "trolley " .. axis }
    end
    if drive == "course" then
      rows[4] = rd.drive { "travel_x", p.near + (p.far - p.near) * rd.smoothstep(s.t, 0, p.T) }
    end
    return rows
  end,
  hold = "travel_x",
}
