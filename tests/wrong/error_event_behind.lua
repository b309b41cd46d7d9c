-- expect: 0: setmetatable: __eq was changed after the call; set it before
local rd = require "refdyn"
local V = {}
local v = setmetatable({}, V)
function V.__eq(a, b) return true end
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
