-- The reference manipulator as all programs of this folder compute it: without programme, with the torque on the column as input tau.
-- Option hold: "tip" adds three rows that keep the acceleration of the tip zero, "none" adds none.
-- The file takes manipulator.lua next to it and its options drive=input and program=none.
local rd = require "refdyn"
local model = rd.model
local hold = rd.option("hold", "none", { "none", "tip" })

local function row(value, name)
  return rd.position { value, alpha = 0, beta = 0, name = name }                        -- no stabilisation
end

function rd.model(it)
  function it.constraints(s)
    local E = s.points.E
    return hold == "tip" and { row(E.x, "x"), row(E.y, "y"), row(E.z, "z") } or {}
  end
  return model(it)
end

return require "manipulator"
