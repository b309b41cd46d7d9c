-- Not a model: model.lua requires this file.
local rd = require "refdyn"
local parts = {}

function parts.bar(length, mass)
  return rd.box { { length, 0.05, 0.05 }, mass = mass, at = { length / 2, 0, 0 } }
end

return parts
