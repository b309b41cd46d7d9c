-- expect: 0: more than 256 MB of memory to read the model
-- Tries an endless number of functions.
local rd = require "refdyn"
local f
while true do local g = f; f = function() return g end end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
