/PROG  WALL_CELL2	  Macro
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "wall; 2 groups";
PROG_SIZE	= 2184;
CREATE		= DATE 19-02-01  TIME 08:00:10;
MODIFIED	= DATE 19-02-01  TIME 08:32:44;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 21;
MEMORY_SIZE	= 2612;
PROTECT		= READ_WRITE;
TCD:  STACK_SIZE	= 0,
      TASK_PRIORITY	= 50,
      TIME_SLICE	= 0,
      BUSY_LAMP_OFF	= 0,
      ABORT_REQUEST	= 0,
      PAUSE_REQUEST	= 0;
DEFAULT_GROUP	= 1,1,*,*,*;
CONTROL_CODE	= 00000000 00000000;
LOCAL_REGISTERS	= 0,0,0;
/APPL

AUTO_SINGULARITY_HEADER;
  ENABLE_SINGULARITY_AVOIDANCE   : FALSE;

  ARC Welding Equipment : 1,*,*,*,*,*;
/MN
   1:  --eg:wall, two groups ;
   2:  UTOOL_NUM=1 ;
   3:  UFRAME_NUM=2 ;
   4:  PAYLOAD[1] ;
   5:  R[12:speed]=75 ;
   6:  R[13:cnt]=50 ;
   7:  ;
   8:J P[1:HOME] R[14]% FINE    ;
   9:  //J P[9] 100% FINE    ;
  10:J P[2] 30% CNT100    ;
  11:L P[3] 150cm/min FINE
    :  Weld Start[1,2]    ;
  12:  Weave Sine[1] ;
  13:L P[4:"mid point"] R[12]cm/min CNT R[13] ACC80    ;
  14:A P[5] 75.0cm/min CNT100    ;
  15:A P[6] 75.0cm/min CNT100    ;
  16:A P[7] 75.0cm/min CNT100    ;
  17:  Weave End ;
  18:L P[8] WELD_SPEED FINE Weld End[1,2]    ;
  19:  CALL TORCH_CLEAN(1,'full') ;
  20:J P[1:HOME] 100% FINE    ;
  21:  END ;
/POS
P[1:"HOME"]{
   GP1:
	UF : 2, UT : 1,	
	J1=     0.000 deg,	J2=   -20.000 deg,	J3=    10.000 deg,
	J4=     0.000 deg,	J5=   -90.000 deg,	J6=     0.000 deg
   GP2:
	UF : 2, UT : 1,	
	J1=     0.000 deg,	J2=     0.000 deg
};
P[2]{
   GP1:
	UF : 2, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =      .000  mm,	Y =     0.000  mm,	Z =    50.000  mm,
	W =  -180.000 deg,	P =     0.000 deg,	R =     0.000 deg
   GP2:
	UF : 2, UT : 1,
	J1=    15.000 deg,	J2=     0.000 deg
};
P[3]{
   GP1:
	UF : 2, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     0.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =  -180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[4:"mid point"]{
   GP1:
	UF : 2, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    40.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =  -180.000 deg,	P =     0.000 deg,	R =     0.000 deg,
	E1=   250.000  mm
};
P[5]{
   GP1:
	UF : 2, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    60.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =  -180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[6]{
   GP1:
	UF : 2, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    74.142  mm,	Y =     5.858  mm,	Z =     0.000  mm,
	W =  -180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[7]{
   GP1:
	UF : 2, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    80.000  mm,	Y =    20.000  mm,	Z =     0.000  mm,
	W =  -180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[8]{
   GP1:
	UF : 2, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    80.000  mm,	Y =    60.000  mm,	Z =     0.000  mm,
	W =  -180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[9]{
   GP1:
	UF : F, UT : F,		CONFIG : 'N U T, 0, 0, 0',
	X =  ********  mm,	Y =  ********  mm,	Z =  ********  mm,
	W =  ******** deg,	P =  ******** deg,	R =  ******** deg
};
/END
