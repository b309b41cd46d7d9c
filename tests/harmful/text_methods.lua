-- expect: 4: attempt to index a string value
-- Tries to change the functions of all texts.
local rd = require "refdyn"
getmetatable("").__index = function() while true do end end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
