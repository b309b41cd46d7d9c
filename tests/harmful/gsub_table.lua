-- expect: 5: string.gsub: more than the 100 million steps that reading a model may take
-- Tries a million look-ups by gsub, many times.
local rd = require "refdyn"
local s = ("x"):rep(1e6)
for i = 1, 1e6 do s:gsub(".", { x = "y" }) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
