-- The reference manipulator as all programs of this folder compute it: with a force as input tau_COORDINATE on each coordinate.
-- Option hold: "tip" adds three rows that keep the acceleration of the tip zero. The file takes manipulator.lua next to it.
local rd = require "refdyn"
local model = rd.model
local hold = rd.option("hold", "none", { "none", "tip" })

local function loads(links)
  local found = {}
  local function load(name) found[name] = rd.input("tau_" .. name) end
  for _, link in ipairs(links) do
    for _, joint in ipairs(link.joint) do load(link[1] .. "_" .. joint) end
    for r = 1, (link.beam and link.beam.rfe or 1) - 1 do
      for _, turn in ipairs { "psi", "theta", "phi" } do load(link[1] .. "_" .. turn .. "_" .. r) end
    end
  end
  return found
end

local function rows(s)
  local E = s.points.E
  if hold == "none" then return {} end
  return {
    rd.position { E.x, alpha = 0, beta = 0, name = "x" },
    rd.position { E.y, alpha = 0, beta = 0, name = "y" },
    rd.position { E.z, alpha = 0, beta = 0, name = "z" },
  }
end

function rd.model(it)
  local all = loads(it.links)
  it.forces, it.courses, it.constraints, it.dependent = function() return all end, nil, rows, nil
  return model(it)
end

return require "manipulator"
