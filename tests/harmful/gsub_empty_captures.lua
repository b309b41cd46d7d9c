-- expect: 0: a text of more than 4 MB; texts must be shorter
-- Tries the same with captures of no letters.
local rd = require "refdyn"
local s, by = ("x"):rep(1e4), ("%1"):rep(1e4)
for i = 1, 1e5 do s:gsub("(x?)x", by) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
