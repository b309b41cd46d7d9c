-- expect: 4: name "m\x00x": contains control character 0; remove it
local rd = require "refdyn"
local p = rd.parameters { { "m", 1 } }
local x = p["m\0x"]
