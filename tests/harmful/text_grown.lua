-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries a text that grows by a letter.
local rd = require "refdyn"
local s = ""
while true do s = s .. "x" end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
