-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries a million calls of a function by gsub, many times.
local rd = require "refdyn"
local s = ("x"):rep(1e6)
for i = 1, 1e6 do s:gsub(".", function(c) return c end) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
