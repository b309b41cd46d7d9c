-- expect: 4: setmetatable: __pairs is not allowed in a model
-- Tries __pairs, which could run in any order.
local rd = require "refdyn"
setmetatable({}, { __pairs = function() while true do end end })
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
