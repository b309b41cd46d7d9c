-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries to look up long texts that collide.
local rd = require "refdyn"
local t = { [("x"):rep(1e6) .. "a"] = 1 }
for i = 1, 1e7 do local s = t[("x"):rep(1e6) .. "b"] end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
