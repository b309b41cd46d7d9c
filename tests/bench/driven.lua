-- The reference manipulator with a force of its own, an input tau_COORDINATE, on each coordinate: what the peers' model is.
-- Takes manipulator.lua beside it, with all of its options; gives that model without its torque and courses.
local rd = require "refdyn"
local model = rd.model

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

function rd.model(it)
  local all = loads(it.links)
  it.forces, it.courses = function() return all end, nil
  return model(it)
end

return require "manipulator"
