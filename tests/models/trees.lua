-- Trees whose bodies carry several branches: two long ones, three of different lengths on one body, branches of branches in two trees, a spine
-- with `rfe` ribs, a short tree, and a force between turns at one point. test_acceleration_sweeps.py compares the two forms of the derivatives of accelerations.
local rd   = require "refdyn"
local kind = rd.option("kind", "two")
local rfe  = rd.option("rfe", 4, { from = 1, to = 64 })
local p    = rd.parameters { { "g", 9.81, "m/s^2" }, { "E", 2e9, "Pa" }, { "m", 0.4, "kg" } }

-- A beam that bends and twists.
local function beam(name, on, fields)
  local link = { name, on = on, beam = { length = 1.1, section = rd.rectangle(0.02, 0.012), E = p.E, nu = 0.3, rho = 1200, rfe = rfe, eta = 1e-3 } }
  for field, entry in pairs(fields or {}) do link[field] = entry end
  return link
end

local function body(name, on, fields)
  local link = { name, on = on, mass = p.m, center = { 0.05, 0.1, -0.02 }, inertia = { xx = 0.011, yy = 0.007, zz = 0.013, xy = 5e-4, xz = -8e-4 } }
  for field, entry in pairs(fields or {}) do link[field] = entry end
  return link
end

-- Each body of a binary tree turns or slides on the one before it.
local function add_binary(links, name, on, depth)
  local joints = { { joint = "psi", spring = { psi = 3 } }, { joint = { "y", "theta" }, spring = { y = 40 } }, { joint = { "psi", "theta", "phi" }, damper = { phi = 0.1 } } }
  local fields = joints[depth % 3 + 1]
  links[#links + 1] = body(name, on, { at = { 0.1, 0.2, 0.05 * depth }, turn = { { "z", 0.7 } }, joint = fields.joint, spring = fields.spring, damper = fields.damper })
  if depth > 1 then
    add_binary(links, name .. "a", name, depth - 1)
    if depth % 2 == 0 then add_binary(links, name .. "c", name, 1) end
    add_binary(links, name .. "b", name, depth - 2)
  end
  return links
end

-- The spine first, so that it is the first branch of each of its bodies in the order of coordinates.
local function comb(count)
  local links = {}
  for i = 1, count do
    links[i] = body("spine" .. i, i > 1 and "spine" .. (i - 1) or nil, { at = { 0.2, 0, 0.03 }, joint = i % 2 == 0 and "theta" or "psi" })
    links[count + i] = body("rib" .. i, "spine" .. i, { at = { 0, 0.1, 0 }, joint = i % 3 == 0 and "y" or "phi" })
  end
  return links
end

local hub = body("hub", nil, { joint = { "psi" }, damper = { psi = 0.1 } })
-- The longest branch comes first in the file.
local three = { body("base", nil, { joint = { "x", "phi" }, spring = { x = 90 } }), beam("arm", "base", { joint = "theta" }),
                body("leg", "base", { at = { 0, 0.2, 0.1 }, joint = { "psi", "theta", "phi" } }), body("foot", "leg", { at = { 0, 0.3, 0 }, joint = "psi" }),
                body("tail", "base", { at = { -0.2, 0, 0 }, turn = { { "x", 1 } }, joint = { "z" }, spring = { z = 50 } }) }
local nested = add_binary(add_binary({}, "left", nil, 3), "right", nil, 4)
nested[#nested + 1] = beam("tail", "rightaa")

local cases = {
  two    = { links = { hub, beam("arm", "hub", { at = { 0.1, 0, 0.2 } }), beam("leg", "hub", { at = { -0.1, 0.05, 0 }, turn = { { "z", 2 }, { "y", 0.4 } } }) } },
  three  = { links = three },
  -- Spring and row connect the branches.
  joined = { links = three, forces = function() return { rd.spring { "arm.tip", "foot", stiffness = 40, rest = 0.3 } } end,
             constraints = function() return { rd.distance { "tail", "foot", 0.6, alpha = 3, beta = 4 } } end },
  nested = { links = nested, forces = function() return { rd.force { "tail.tip", { 1, -2, 3 } } } end },
  comb   = { links = comb(rfe) },
  short  = { links = { hub, body("left", "hub", { at = { 0.1, 0, 0.2 }, joint = "theta" }), body("right", "hub", { at = { -0.1, 0, 0 }, joint = "phi" }) } },
  -- The force acts on a body without mass between turns that are eliminated together.
  between = { links = { hub, { "yoke", on = "hub", at = { 0.1, 0, 0.2 }, joint = { "theta", "phi" } }, body("wrist", "yoke", { joint = "psi" }) },
              forces = function() return { rd.force { { on = "yoke", at = { 0.1, -0.2, 0.3 } }, { 15, -25, 35 } }, rd.torque { "yoke", { 2, 3, -1 } } } end },
}
local scene = cases[kind] or error("option kind: no such case")
return rd.model { name = "trees", gravity = { 0.1 * p.g, 0, -p.g }, links = scene.links, forces = scene.forces, constraints = scene.constraints }
