-- expect: 4: more than 100 million steps to read the model; look for a loop without an end
-- Tries to change the functions of texts, then use them.
local rd = require "refdyn"
string.rep = function() while true do end end
local s = ("x"):rep(3)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
