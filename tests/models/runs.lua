-- Runs of equal elements, which become loops: beams of `rfe` elements and chains of as many equal links, with other links
-- before, between and after them. Each case is a separate model; test_loops.py compares loops with straight code.
local rd   = require "refdyn"
local kind = rd.option("kind", "order")
local rfe  = rd.option("rfe", 4, { from = 2, to = 64 })
local p    = rd.parameters { { "g", 9.81, "m/s^2" }, { "E", 2e9, "Pa" }, { "rho", 1200, "kg/m^3" }, { "d", 0.02, "m" }, { "m", 0.4, "kg" } }
local tau  = rd.input("tau", 0.7, "N m")

local function beam(fields)
  local result = { length = 1.1, section = rd.round(p.d), E = p.E, nu = 0.3, rho = p.rho, rfe = rfe }
  for name, field in pairs(fields or {}) do result[name] = field end
  return result
end

local function chain(name, count, fields)
  local links = {}
  for i = 1, count do
    local link = { name .. i, on = i > 1 and name .. (i - 1) or nil, at = { 0.2, 0.01, 0 }, joint = "theta", mass = 0.3,
                   center = { 0.1, 0, 0.02 }, inertia = { xx = 1e-3, yy = 4e-3, zz = 4e-3, xz = 2e-4 }, spring = { theta = 3 }, damper = { theta = 0.02 } }
    for field, entry in pairs(fields or {}) do link[field] = entry end
    links[i] = link
  end
  return links
end

local load = { "load", on = "arm.tip", at = { 0.05, 0, 0 }, joint = "y", mass = p.m, center = { 0, 0, 0.1 }, spring = { y = 80 } }
local function joined(first, second)
  local all = {}
  for _, link in ipairs(first) do all[#all + 1] = link end
  for _, link in ipairs(second) do all[#all + 1] = link end
  return all
end

-- The first link is placed on the carrier of the chain, the others at the end of the previous link.
local function at_root(links)
  links[1].on, links[1].at = "link0", nil
  return links
end

-- Two turns at one point, in separate links, the first without mass.
local function universal(count)
  local links = {}
  for i = 1, count do
    links[2 * i - 1] = { "a" .. i, on = i > 1 and "b" .. (i - 1) or nil, at = { 0.3, 0, 0 }, joint = "psi", spring = { psi = 3 } }
    links[2 * i] = { "b" .. i, on = "a" .. i, joint = "theta", mass = 0.4, center = { 0.15, 0.01, 0 }, inertia = { xx = 1e-3, yy = 4e-3, zz = 4e-3 } }
  end
  return links
end

-- Equal beams, each on a hinge at the end of the previous one.
local function arms(count, fields)
  local links = {}
  for i = 1, count do
    links[i] = { "part" .. i, on = i > 1 and "part" .. (i - 1) .. ".tip" or nil, joint = "theta", spring = { theta = 5 }, beam = beam(fields) }
  end
  return links
end

local slides = { joint = { "x", "psi" }, spring = { x = 90, psi = 4 }, rest = { x = 0.01 }, damper = { x = 0.5, psi = 0.02 },
                 inertia = { xx = 1e-3, yy = 4e-3, zz = 4e-3 } }

local cases = {
  -- runs at the root, at the tip, and alone
  beam     = { links = { { "arm", beam = beam() } }, points = { E = "arm.tip" } },
  bare     = { links = { { "arm", beam = beam() } } },
  hinged   = { links = { { "arm", joint = "theta", beam = beam { eta = 1e-3 } } } },
  weighted = { links = { { "arm", at = { 0, 0, 1 }, turn = { { "y", 0.3 } }, beam = beam() }, load } },
  planar   = { links = { { "arm", joint = "psi", beam = beam { dofs = "psi", eta = 2e-3 } }, load }, points = { E = "arm.tip" } },
  bending  = { links = { { "arm", beam = beam { dofs = "psi, theta", curvature = { psi = 0.3, theta = -0.2 } } }, load } },
  twisted  = { links = { { "arm", beam = beam { dofs = "phi", damping = { phi = 0.01 } } }, load } },
  -- parallel links that differ; several segments
  sides    = { links = { { "column", joint = "psi", mass = 2, inertia = { zz = 0.3 } },
                         { "arm", on = "column", beam = beam { eta = 1e-3 } }, load,
                         { "other", on = "column", at = { 0, 0, 0.4 }, turn = { { "z", 2 } }, joint = "theta",
                           beam = beam { length = 0.7, rfe = rfe + 1, section = rd.rectangle(0.02, 0.01), dofs = "theta, phi" } } } },
  segments = { links = { { "arm", joint = "theta",
                           beam = { E = p.E, nu = 0.3, rho = p.rho, section = rd.round(p.d), rfe = rfe,
                                    segments = { { length = 0.5, eta = 1e-3 }, { length = 0.3, section = rd.round(0.015), damping = { psi = 0.1, theta = 0.1, phi = 0.05 } },
                                                 { length = 0.4, rfe = rfe + 2, curvature = { theta = 0.2 }, eta = 2e-3 } } } }, load } },
  -- children and points at the tip and in the middle; coordinates not numbered depth first
  tree     = { links = { { "arm", joint = "psi", beam = beam { eta = 1e-3 } }, load,
                         { "second", on = "arm.tip", turn = { { "y", 1 } }, beam = beam { length = 0.6 } },
                         { "rider", on = "arm", along = 0.5, joint = "theta", mass = 0.3, center = { 0, 0, -0.2 } } },
               points = { E = "arm.tip", F = "second.tip", mid = { on = "second", along = 0.2 } } },
  order    = { links = joined({ { "base", joint = "z", mass = 1 } },
                              joined({ { "arm", on = "base", beam = beam() }, { "other", on = "base", joint = "phi", beam = beam { length = 0.8 } } },
                                     { load, { "late", on = "base", joint = "x", mass = 0.2 }, { "end", on = "other.tip", beam = beam() } })),
               points = { E = "load", F = "end.tip" } },
  middle   = { links = { { "arm", beam = beam { rfe = 2 * rfe } }, load }, points = { mid = { on = "arm", along = 0.55, at = { 0, 0.1, 0 } }, E = "arm.tip" },
               forces = function(s) return { rd.force { "mid", { 0, 1 + s.t, -2 } }, rd.force { "E", { 0, 0, -3 }, axes = "E" } } end },
  -- equal links, written in a loop
  chain    = { links = chain("link", rfe), points = { E = { on = "link" .. rfe, at = { 0.2, 0, 0 } } } },
  slides   = { links = chain("link", rfe, slides), points = { E = "link" .. rfe } },
  swinging = { links = joined({ { "link0", joint = "free", mass = 1, inertia = { xx = 0.1, yy = 0.2, zz = 0.15 } } }, chain("link", rfe)) },
  balls    = { links = chain("link", rfe, { joint = "psi, theta, phi", spring = { psi = 2, phi = 1 }, damper = {} }) },
  same     = { links = joined({ { "link0", joint = "psi", mass = 0.5, center = { 0.1, 0, 0.1 }, inertia = { zz = 0.01 } } }, at_root(chain("link", rfe))) },
  hooke    = { links = universal(rfe), points = { E = "b" .. rfe } },
  beams    = { links = arms(rfe, { dofs = "psi, theta", rfe = 3 }), points = { E = "part" .. rfe .. ".tip" } },
  tools    = { links = joined(arms(rfe, { rfe = 2 }), { { "tool", on = "part" .. rfe .. ".tip", joint = "psi, theta, phi", mass = p.m, inertia = { xx = 0.01, yy = 0.02, zz = 0.02 } } }) },
  -- forces
  named    = { links = { { "arm", beam = beam { rfe = 2 * rfe } }, load },
               forces = function(s) return { ["arm_psi_" .. rfe] = tau * rd.sin(s.t) - 0.1 * s.qd["arm_psi_" .. rfe] } end },
  friction = { links = chain("link", rfe),
               forces = function(s)
                 local all = {}
                 for i = 1, rfe do all["link" .. i .. "_theta"] = rd.friction(0.2, s.qd["link" .. i .. "_theta"], 0.1) end
                 return all
               end },
  following = { links = { { "arm", joint = "theta", beam = beam { eta = 1e-3 } } }, points = { E = { on = "arm.tip", at = { 0, 0, 0.02 } } },
                forces = function(s) return { rd.force { "E", { 0, 2 * tau, -5 }, axes = "arm.tip" }, rd.torque { "arm.tip", { 0.2, 0, tau }, axes = "E" } } end },
  spread   = { links = { { "arm", beam = beam { rfe = 3 * rfe } } },
               forces = function(s)
                 local all = {}
                 for i = 1, 3 do all[i] = rd.force { { on = "arm", along = 0.35 * i }, { 0, 0, -2 - s.t } } end
                 return all
               end },
  springs  = { links = { { "arm", joint = "theta", beam = beam { rfe = 2 * rfe } }, { "other", at = { 0, 0.6, 0 }, joint = "theta", beam = beam { dofs = "psi, theta" } } },
               forces = function(s)
                 return { rd.spring { { on = "arm", along = 0.55 }, "other.tip", stiffness = 40, rest = 0.3 }, rd.damper { "arm.tip", "other.tip", damping = 2 },
                          rd.actuator { "arm.tip", { on = "ground", at = { 1, 1, 2 } }, tau * rd.sin(s.t) } }
               end },
  energies = { links = { { "arm", joint = "theta", beam = beam() }, load }, points = { E = "arm.tip" },
               forces = function(s) return { rd.energy { 20 * (s.points.E.x^2 + s.points.E.z * s.q.load_y) * rd.cos(s.q.arm_theta) } } end },
  -- rows
  closed   = { links = { { "crank", joint = "theta", mass = 0.5, center = { 0.2, 0, 0 }, inertia = { yy = 0.01 } },
                         { "arm", on = "crank", at = { 0.4, 0, 0 }, joint = "theta", beam = beam { dofs = "theta", eta = 1e-3 } },
                         { "rocker", on = "arm.tip", joint = "theta", beam = beam { length = 0.8, dofs = "theta" } } },
               constraints = function(s) return { rd.loop { "rocker.tip", { on = "ground", at = { 1.2, 0, -0.5 } }, keep = "x, z", alpha = 5, beta = 5 } } end },
  rods     = { links = { { "arm", joint = "theta", beam = beam { rfe = 2 * rfe } }, { "other", at = { 0, 0.5, 0 }, joint = { "psi", "theta" }, beam = beam() } },
               constraints = function(s)
                 return { rd.distance { { on = "arm", along = 0.55 }, "other.tip", 0.8 + 0.1 * rd.sin(s.t) }, rd.on_plane { "arm.tip", { "ground", { 1, 2, 3 } }, alpha = 2, beta = 3 } }
               end },
  on_line  = { links = { { "arm", joint = { "psi", "theta" }, beam = beam() }, load }, points = { E = "arm.tip" },
               constraints = function(s)
                 return { rd.on_line { "E", { "ground", { 0, 1, 0.2 }, at = { 1, 0, 0 } }, alpha = 4, beta = 4 }, rd.velocity { s.points.E.yd - 0.3 - 0.1 * s.t, alpha = 3 } }
               end },
  rows     = { links = { { "arm", joint = "psi", beam = beam { rfe = 3 * rfe } }, load }, points = { E = "load" },
               constraints = function(s)
                 local first, second = "arm_theta_" .. rfe, "arm_psi_" .. rfe + 1
                 return { rd.position { s.q[first] + s.q.load_y * s.points.E.x - 0.1 * rd.sin(s.t), alpha = 2, beta = 3 },
                          rd.velocity { s.qd[second] * (1 + s.qd.arm_psi) - 0.2 * s.points.E.zd }, rd.acceleration { s.qdd.arm_psi + 2 * s.qdd[second] - s.points.E.zdd } }
               end },
  driven   = { links = chain("link", 2 * rfe), constraints = function(s) return { rd.drive { "link1_theta", 0.3 * rd.sin(s.t), alpha = 3, beta = 3 }, rd.lock { "link" .. rfe .. "_theta" } } end },
  -- position of the ground
  floating = { links = { { "hub", joint = "free", mass = 3, inertia = { xx = 0.2, yy = 0.3, zz = 0.4 } }, { "arm", on = "hub", at = { 0.2, 0, 0 }, beam = beam { eta = 1e-3 } },
                         { "other", on = "hub", at = { -0.2, 0, 0 }, turn = { { "z", rd.pi } }, beam = beam { eta = 1e-3 } } }, gravity = false },
  weightless = { links = { { "arm", joint = "phi", beam = beam() } }, gravity = false },
  -- rotors, on one and on three turns, and axes that are not frame axes
  geared   = { links = chain("link", rfe, { joint = "psi, theta, phi", spring = { psi = 2, phi = 1 }, damper = {},
                                            rotor = { psi = { inertia = p.m, gear = 0.2 }, phi = { inertia = 3e-3 } } }) },
  skew     = { links = chain("link", rfe, { axis = { 0.3, 0.8, -0.2 }, rotor = { theta = { inertia = 2e-4, gear = -9 } } }),
               points = { E = { on = "link" .. rfe, at = { 0.2, 0, 0 } } } },
}

local scene = cases[kind] or error("option kind: no such case")
return rd.model {
  name = "runs", gravity = scene.gravity ~= false and { 0.1 * p.g, 0, -p.g } or nil,
  links = scene.links, points = scene.points, forces = scene.forces, constraints = scene.constraints,
}
